#include "repose/mechanics/nodal_volumes.h"

#include <algorithm>
#include <numeric>

#include "prism_stacks.h"
#include "repose/mechanics/prism_volume.h"

namespace repose::mechanics {

namespace {

constexpr double share = 1.0 / 6;  // of a prism, to each of its points
constexpr double unit = 1.0 / 36;  // of a volume (prism_stacks.h)
constexpr int64_t none = -1;

/// [P] Σ (v − V) of the prisms around each point, mm³.
std::vector<double> volume_changes(const NodalVolumes& nodal, std::span<const Vec3> position) {
  std::vector<double> sum(nodal.stiffness.size(), 0.0);
  for_each_two_stacks(nodal, [&](const TwoStacks& stacks, int64_t prisms) {
    Face a = stacks.face(position, 0);
    Triple<Pair> normal_a = normal(a);
    Pair above{};
    for (int64_t k = 0; k < prisms; ++k) {
      const Face b = stacks.face(position, k + 1);
      const StackedPrism prism(a, b);
      const Triple<Pair> normal_b = normal(b);
      const Triple<Pair> n = normal_a + normal_b + prism.side1.cross(prism.side2);
      const Pair change = unit * prism.d.dot(n) - stacks.of_prism(nodal.rest_volume, k);
      stacks.add_to_face(k, above + change, sum);
      above = change;
      a = b;
      normal_a = normal_b;
    }
    stacks.add_to_face(prisms, above, sum);
  });
  return sum;
}

/// [P] Σ ∂v/∂x · direction, mm².
std::vector<double> volume_rates(const NodalVolumes& nodal, std::span<const Vec3> position,
                                 std::span<const Vec3> direction) {
  std::vector<double> sum(nodal.stiffness.size(), 0.0);
  for_each_two_stacks(nodal, [&](const TwoStacks& stacks, int64_t prisms) {
    Face a = stacks.face(position, 0), move_a = stacks.face(direction, 0);
    Triple<Pair> normal_a = normal(a), turned_a = normal_change(a, move_a);
    Pair above{};
    for (int64_t k = 0; k < prisms; ++k) {
      const Face b = stacks.face(position, k + 1), move_b = stacks.face(direction, k + 1);
      const StackedPrism prism(a, b), move(move_a, move_b);
      const Triple<Pair> normal_b = normal(b), turned_b = normal_change(b, move_b);
      const Triple<Pair> n = normal_a + normal_b + prism.side1.cross(prism.side2);
      const Triple<Pair> turned =
          turned_a + turned_b + move.side1.cross(prism.side2) + prism.side1.cross(move.side2);
      const Pair rate = unit * (move.d.dot(n) + prism.d.dot(turned));
      stacks.add_to_face(k, above + rate, sum);
      above = rate;
      a = b;
      move_a = move_b;
      normal_a = normal_b;
      turned_a = turned_b;
    }
    stacks.add_to_face(prisms, above, sum);
  });
  return sum;
}

/// Replaces Σ (v − V), or its rate, by a sixth of e/C; returns the energy, as it is counted.
double make_pressures(const NodalVolumes& nodal, std::vector<double>& sum) {
  double energy = 0;
  for (size_t p = 0; p < sum.size(); ++p) {
    const double change = share * sum[p], pressure = nodal.stiffness[p] * change;
    if (static_cast<int64_t>(p) < nodal.counted) energy += 0.5 * pressure * change;
    sum[p] = share * pressure;
  }
  return energy;
}

/// [M] The prism below each, or none.
std::vector<int64_t> find_below(const model::Model& part) {
  const auto& prisms = part.prisms.points;
  std::vector<int64_t> begin(part.points.position.size() + 1, 0), by_first(prisms.size()), below;
  for (const auto& corners : prisms) ++begin[corners[0] + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int64_t> end(begin.begin(), begin.end() - 1);
  for (size_t m = 0; m < prisms.size(); ++m)
    by_first[end[prisms[m][0]]++] = static_cast<int64_t>(m);
  for (const auto& corners : prisms) {
    const auto first = by_first.begin() + begin[corners[3]];
    const auto last = by_first.begin() + begin[corners[3] + 1];
    const auto found = std::find_if(first, last, [&](int64_t m) {
      return std::equal(corners.begin() + 3, corners.end(), prisms[m].begin());
    });
    below.push_back(found == last ? none : *found);
  }
  return below;
}

/// Rows of prisms from the top down, the stacks by their number of prisms, then by their points in
/// memory.
std::vector<std::vector<int64_t>> find_stacks(const model::Model& part) {
  const auto& prisms = part.prisms.points;
  const std::vector<int64_t> below = find_below(part);
  std::vector<char> hangs(prisms.size(), 0), taken(prisms.size(), 0);
  for (const int64_t m : below)
    if (m != none) hangs[m] = 1;
  std::vector<std::vector<int64_t>> stacks;
  for (const bool from_the_top : {true, false})
    for (size_t m = 0; m < prisms.size(); ++m) {
      if (taken[m] || (from_the_top && hangs[m])) continue;
      std::vector<int64_t>& stack = stacks.emplace_back();
      for (auto at = static_cast<int64_t>(m); at != none && !taken[at]; at = below[at]) {
        stack.push_back(at);
        taken[at] = 1;
      }
    }
  std::ranges::stable_sort(stacks, {}, [&](const std::vector<int64_t>& stack) {
    return std::pair(stack.size(), std::ranges::min(prisms[stack.front()]));
  });
  return stacks;
}

/// Adds a sixth of ∂v/∂x of a prism.
void add_gradient(const std::array<int32_t, 6>& points, const PrismSlope<double>& v,
                  NodalGradient& sum) {
  for (int c = 0; c < 6; ++c) {
    const auto known = std::ranges::find(sum.points, points[c]);
    const auto k = static_cast<size_t>(known - sum.points.begin());
    if (known == sum.points.end()) {
      sum.points.push_back(points[c]);
      sum.gradient.emplace_back(Vec3::Zero());
    }
    sum.gradient[k] += share * vec3(v.gradient[c]);
  }
}

void add_prism(const model::Model& part, int64_t row, int64_t owned_prisms, NodalVolumes& nodal) {
  const model::Prisms& prisms = part.prisms;
  const double v0 = prisms.rest_volume[row], averaged = prisms.nodal_modulus[row];
  const bool soft = model::touches_soft_tissue(part.points, prisms.points[row]);
  nodal.place[row] = std::ssize(nodal.rest_volume);
  nodal.rest_volume.push_back(v0);
  nodal.own_stiffness.push_back((prisms.modulus[row] - averaged) / v0);
  nodal.own_target.push_back(own_target_volume(prisms, row));
  nodal.counted_share.push_back(soft && row < owned_prisms ? 1 : 0);
}

}  // namespace

double own_target_volume(const model::Prisms& prisms, int64_t row) {
  const double v0 = prisms.rest_volume[row], target = prisms.target_volume[row];
  if (prisms.nodal_modulus.empty()) return target;
  const double modulus = prisms.modulus[row];
  return v0 + (target - v0) * modulus / (modulus - prisms.nodal_modulus[row]);
}

std::vector<double> nodal_stiffness(const model::Model& part, double max_bulk) {
  const model::Prisms& prisms = part.prisms;
  std::vector<double> result(part.points.position.size(), 0.0);  // the compliance first
  for (size_t m = 0; m < prisms.points.size(); ++m) {
    const double bulk = std::min(prisms.nodal_modulus[m], max_bulk * prisms.shear_modulus[m]);
    for (const int64_t p : prisms.points[m]) result[p] += share * prisms.rest_volume[m] / bulk;
  }
  for (double& c : result) c = c > 0 ? 1 / c : 0;
  return result;
}

NodalVolumes make_nodal_volumes(const model::Model& part, int64_t owned, int64_t owned_prisms) {
  const model::Prisms& prisms = part.prisms;
  NodalVolumes nodal;
  if (prisms.nodal_modulus.empty()) return nodal;
  nodal.place.resize(prisms.points.size());
  for (const auto& stack : find_stacks(part)) {
    const auto size = std::ssize(stack);
    if (nodal.stacks.empty() || nodal.stacks.back().prisms != size)
      nodal.stacks.push_back({size, 0, std::ssize(nodal.rest_volume), std::ssize(nodal.points)});
    ++nodal.stacks.back().count;
    const auto& top = prisms.points[stack.front()];
    nodal.points.insert(nodal.points.end(), top.begin(), top.begin() + 3);
    for (const int64_t row : stack) {
      const auto& corners = prisms.points[row];
      nodal.points.insert(nodal.points.end(), corners.begin() + 3, corners.end());
      add_prism(part, row, owned_prisms, nodal);
    }
  }
  nodal.stiffness = nodal_stiffness(part);
  nodal.counted = owned;
  return nodal;
}

std::vector<double> nodal_slopes(const NodalVolumes& nodal, std::span<const Vec3> position) {
  std::vector<double> pressure = volume_changes(nodal, position);
  make_pressures(nodal, pressure);
  std::vector<double> slopes(nodal.rest_volume.size());
  for_each_two_stacks(nodal, [&](const TwoStacks& stacks, int64_t prisms) {
    Pair above = stacks.sum_over_face(pressure, 0);
    for (int64_t k = 0; k < prisms; ++k) {
      const Pair below = stacks.sum_over_face(pressure, k + 1);
      stacks.set_prism(k, above + below, slopes);
      above = below;
    }
  });
  return slopes;
}

double nodal_energy(const NodalVolumes& nodal, std::span<const Vec3> position) {
  std::vector<double> change = volume_changes(nodal, position);
  return make_pressures(nodal, change);
}

double add_nodal_gradient(const NodalVolumes& nodal, std::span<const Vec3> position, double weight,
                          std::span<Vec3> gradient) {
  std::vector<double> pressure = volume_changes(nodal, position);
  const double averaged = make_pressures(nodal, pressure);
  double twice_own = 0;
  for_each_two_stacks(nodal, [&](const TwoStacks& stacks, int64_t prisms) {
    Face a = stacks.face(position, 0);
    Pair above = stacks.sum_over_face(pressure, 0);
    FaceForce force;
    for (int64_t k = 0; k < prisms; ++k) {
      const Face b = stacks.face(position, k + 1);
      const Pair below = stacks.sum_over_face(pressure, k + 1);
      const StackedPrism prism(a, b);
      const Triple<Pair> top1 = a.edge1 + prism.side1, top2 = a.edge2 + prism.side2;
      const Triple<Pair> bottom1 = b.edge1 + prism.side1, bottom2 = b.edge2 + prism.side2;
      const Triple<Pair> n = a.edge1.cross(top2) + b.edge1.cross(bottom2);
      const Pair beyond = unit * prism.d.dot(n) - stacks.of_prism(nodal.own_target, k);
      const Pair own = stacks.of_prism(nodal.own_stiffness, k) * beyond;
      twice_own += stacks.sum(stacks.of_prism(nodal.counted_share, k) * (own * beyond));
      const Pair slope = weight * unit * (own + above + below);
      const Triple<Pair> d = slope * prism.d, whole = slope * n;
      force.add({top2.cross(d), d.cross(top1), -whole});
      stacks.add_to_face(k, force, gradient);
      force = {bottom2.cross(d), d.cross(bottom1), whole};
      a = b;
      above = below;
    }
    stacks.add_to_face(prisms, force, gradient);
  });
  return 0.5 * twice_own + averaged;
}

void add_nodal_action(const NodalVolumes& nodal, std::span<const Vec3> position,
                      std::span<const double> slopes, double weight,
                      std::span<const Vec3> direction, std::span<Vec3> product) {
  std::vector<double> rates = volume_rates(nodal, position, direction);
  make_pressures(nodal, rates);
  for_each_two_stacks(nodal, [&](const TwoStacks& stacks, int64_t prisms) {
    Face a = stacks.face(position, 0), move_a = stacks.face(direction, 0);
    Pair above = stacks.sum_over_face(rates, 0);
    FaceForce force;
    for (int64_t k = 0; k < prisms; ++k) {
      const Face b = stacks.face(position, k + 1), move_b = stacks.face(direction, k + 1);
      const Pair below = stacks.sum_over_face(rates, k + 1);
      const StackedPrism x(a, b), c(move_a, move_b);
      const Triple<Pair> top1 = a.edge1 + x.side1, top2 = a.edge2 + x.side2;
      const Triple<Pair> bottom1 = b.edge1 + x.side1, bottom2 = b.edge2 + x.side2;
      const Triple<Pair> moved1 = move_a.edge1 + c.side1, moved2 = move_a.edge2 + c.side2;
      const Triple<Pair> moved3 = move_b.edge1 + c.side1, moved4 = move_b.edge2 + c.side2;
      const Triple<Pair> n = a.edge1.cross(top2) + b.edge1.cross(bottom2);
      const Triple<Pair> turned = move_a.edge1.cross(top2) + a.edge1.cross(moved2) +
                                  move_b.edge1.cross(bottom2) + b.edge1.cross(moved4);
      const Pair own = stacks.of_prism(nodal.own_stiffness, k);
      const Pair beyond = unit * x.d.dot(n) - stacks.of_prism(nodal.own_target, k);
      const Pair rate = unit * (c.d.dot(n) + x.d.dot(turned));
      const Pair slope = weight * unit * (own * beyond + stacks.of_prism(slopes, k));
      const Pair bend = weight * unit * (own * rate + above + below);
      const Triple<Pair> d = slope * x.d, e = bend * x.d + slope * c.d;
      const Triple<Pair> whole = bend * n + slope * turned;
      force.add({top2.cross(e) + moved2.cross(d), e.cross(top1) + d.cross(moved1), -whole});
      stacks.add_to_face(k, force, product);
      force = {bottom2.cross(e) + moved4.cross(d), e.cross(bottom1) + d.cross(moved3), whole};
      a = b;
      move_a = move_b;
      above = below;
    }
    stacks.add_to_face(prisms, force, product);
  });
}

std::vector<NodalGradient> nodal_gradients(const NodalVolumes& nodal, int64_t owned,
                                           std::span<const Vec3> position) {
  std::vector<NodalGradient> result(position.size());
  nodal.for_each_prism([&](int64_t, const std::array<int32_t, 6>& points) {
    const PrismSlope<double> v{PrismEdges<double>(triples(base::pick(position, points)))};
    for (const int32_t p : points)
      if (p < owned) add_gradient(points, v, result[p]);
  });
  return result;
}

std::vector<double> volume_slopes(const model::Model& model, std::span<const Vec3> position) {
  const model::Prisms& prisms = model.prisms;
  const NodalVolumes nodal = make_nodal_volumes(model, 0, 0);
  const std::vector<double> averaged = nodal_slopes(nodal, position);
  std::vector<double> slopes(prisms.points.size(), 0.0);
  for (size_t m = 0; m < slopes.size(); ++m) {
    const double own = prisms.modulus[m] - (nodal.empty() ? 0 : prisms.nodal_modulus[m]);
    const double volume = prism_volume(base::pick(position, prisms.points[m]).data());
    const double v0 = prisms.rest_volume[m], change = volume - v0;
    slopes[m] = (own * change - prisms.modulus[m] * (prisms.target_volume[m] - v0)) / v0;
    if (!nodal.empty()) slopes[m] += averaged[nodal.place[m]];
  }
  return slopes;
}

}  // namespace repose::mechanics
