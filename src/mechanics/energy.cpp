#include "repose/mechanics/energy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "repose/mechanics/hessian.h"
#include "repose/model/material.h"

namespace repose::mechanics {

namespace {

/// Rows of a loop.
struct Section {
  int64_t begin, end;
};

/// Calls add(section) for the rows that count here and for the others; what it returns for the
/// former.
template <class Loop, class Add>
double in_sections(const Loop& loop, Add&& add) {
  const double counted = add(Section{0, loop.counted});
  add(Section{loop.counted, loop.size()});
  return counted;
}

/// Adds the gradient of some rows of a loop and returns the sum of their energies.
template <int p>
double spring_gradient(const SpringLoop& loop, const Section& rows, std::span<const Vec3> position,
                       double scale, std::span<Vec3> gradient) {
  double energy = 0;
  for (int64_t e = rows.begin; e < rows.end; ++e) {
    const auto [i, j] = loop.points[e];
    const Vec3 d = position[j] - position[i];
    const double r = d.norm(), s = r - loop.rest_length[e];
    const double k0 = loop.stiffness[e], inverse = loop.inverse_reference[e];
    const double tension = scale * spring_tension<p>(s, k0, inverse);
    const Vec3 force = (tension / (r > 0 ? r : 1.0)) * d;
    gradient[i] -= force;
    gradient[j] += force;
    energy += spring_energy<p>(s, k0, inverse);
  }
  return energy;
}

/// K w for the spring's exact block K, without forming it: across · w + (along − across) u (u·w).
template <int p>
void spring_action(const SpringLoop& loop, std::span<const Vec3> position, double scale,
                   std::span<const Vec3> direction, std::span<Vec3> product) {
  for (int64_t e = 0; e < loop.size(); ++e) {
    const auto [i, j] = loop.points[e];
    const auto [along, across, u] =
        spring_stiffness<p>(position[j] - position[i], loop.stiffness[e], loop.rest_length[e],
                            loop.inverse_reference[e], Curvature::exact);
    const Vec3 w = scale * (direction[j] - direction[i]);
    const Vec3 force = across * w + ((along - across) * u.dot(w)) * u;
    product[i] -= force;
    product[j] += force;
  }
}

/// A vector in two registers, x and y in one.
struct Halves {
  Pair xy{};
  double z = 0;
};

Halves halves(const Vec3& v) {
  Halves two{{}, v.z()};
  std::memcpy(&two.xy, v.data(), sizeof two.xy);
  return two;
}

/// The edges of one first point after the other: its sum stays in registers.
double edge_gradient(const EdgeLoop& loop, const Section& rows, std::span<const Vec3> position,
                     double scale, std::span<Vec3> gradient) {
  Halves squares;
  for (int64_t e = rows.begin; e < rows.end;) {
    const int32_t i = loop.points[e][0];
    const Halves here = halves(position[i]);
    Halves sum;
    for (; e < rows.end && loop.points[e][0] == i; ++e) {
      const int32_t j = loop.points[e][1];
      const Halves there = halves(position[j]);
      const Halves d = {there.xy - here.xy, there.z - here.z};
      const double w = loop.weight[e];
      const Halves force = {scale * w * d.xy, scale * w * d.z};
      add_halves(force.xy, force.z, gradient[j]);
      sum = {sum.xy - force.xy, sum.z - force.z};
      squares = {squares.xy + w * d.xy * d.xy, squares.z + w * d.z * d.z};
    }
    add_halves(sum.xy, sum.z, gradient[i]);
  }
  return 0.5 * (squares.xy[0] + squares.xy[1] + squares.z);
}

/// The prisms e and e + 1 of a range that ends at `end`: two, or the last one twice.
class TwoPrisms {
 public:
  TwoPrisms(const PrismLoop& loop, int64_t e, int64_t end)
      : first_(e), count_(e + 1 < end ? 2 : 1) {
    const int64_t second = e + count_ - 1;
    corner_ = {&loop.points[e], &loop.points[second]};
    compliance = Pair{loop.compliance[e], loop.compliance[second]};
    target_volume = Pair{loop.target_volume[e], loop.target_volume[second]};
  }
  PrismTriples<Pair> gather(std::span<const Vec3> values) const {
    PrismTriples<Pair> corners;
    for (int c = 0; c < 6; ++c) {
      const Vec3 &a = values[(*corner_[0])[c]], &b = values[(*corner_[1])[c]];
      corners[c] = {Pair{a.x(), b.x()}, Pair{a.y(), b.y()}, Pair{a.z(), b.z()}};
    }
    return corners;
  }
  void scatter(const PrismTriples<Pair>& corners, std::span<Vec3> sums) const {
    for (int k = 0; k < count_; ++k)
      for (int c = 0; c < 6; ++c) {
        double* sum = sums[(*corner_[k])[c]].data();
        sum[0] += corners[c].x[k];
        sum[1] += corners[c].y[k];
        sum[2] += corners[c].z[k];
      }
  }
  Pair clamp(Pair values, std::span<const double> largest) const {
    for (int k = 0; k < count_; ++k)
      values[k] = std::clamp(values[k], -largest[first_ + k], largest[first_ + k]);
    return values;
  }
  double sum(Pair values) const { return count_ == 2 ? values[0] + values[1] : values[0]; }

  Pair compliance, target_volume;

 private:
  int64_t first_;
  int count_;
  std::array<const std::array<int32_t, 6>*, 2> corner_;
};

/// k of the volume term ½ k (v − v_0)², of one prism or of two.
template <class S>
S volume_stiffness(const Weights& weights, const S& compliance) {
  if (weights.volume == VolumeTerm::paper) return S{} + 2 * weights.volume_weight;
  return weights.volume_weight / compliance;
}

double prism_gradient(const PrismLoop& loop, const Section& rows, std::span<const Vec3> position,
                      const Weights& weights, std::span<Vec3> gradient) {
  double value = 0;
  for (int64_t e = rows.begin; e < rows.end; e += 2) {
    const TwoPrisms prisms(loop, e, rows.end);
    const PrismSlope<Pair> v(PrismEdges<Pair>(prisms.gather(position)));
    const Pair stiffness = volume_stiffness(weights, prisms.compliance);
    const Pair change = v.volume - prisms.target_volume, slope = stiffness * change;
    PrismTriples<Pair> force;
    for (int c = 0; c < 6; ++c) force[c] = slope * v.gradient[c];
    prisms.scatter(force, gradient);
    value += prisms.sum(0.5 * slope * change);
  }
  return value;
}

void prism_action(const PrismLoop& loop, std::span<const Vec3> position, const Weights& weights,
                  std::span<const double> max_slope, std::span<const Vec3> direction,
                  std::span<Vec3> product) {
  for (int64_t e = 0; e < loop.size(); e += 2) {
    const TwoPrisms prisms(loop, e, loop.size());
    const PrismEdges<Pair> edges(prisms.gather(position));
    const PrismTriples<Pair> moves = prisms.gather(direction);
    const PrismSlope<Pair> v(edges);
    const PrismTriples<Pair> turned = prism_slope_change(edges, PrismEdges<Pair>(moves));
    const Pair stiffness = volume_stiffness(weights, prisms.compliance);
    Pair slope = stiffness * (v.volume - prisms.target_volume);
    if (!max_slope.empty()) slope = prisms.clamp(slope, max_slope);
    Pair change{};
    for (int c = 0; c < 6; ++c) change += v.gradient[c].dot(moves[c]);
    const Pair bend = stiffness * change;
    PrismTriples<Pair> force;
    for (int c = 0; c < 6; ++c) force[c] = bend * v.gradient[c] + slope * turned[c];
    prisms.scatter(force, product);
  }
}

/// x yᵀ + [w]×, number by number: assembled from vectors it is three times slower.
void set_block(Mat3& block, const Triple<double>& x, const Triple<double>& y,
               const Triple<double>& w) {
  double* k = block.data();
  k[0] = x.x * y.x, k[1] = x.y * y.x + w.z, k[2] = x.z * y.x - w.y;
  k[3] = x.x * y.y - w.z, k[4] = x.y * y.y, k[5] = x.z * y.y + w.x;
  k[6] = x.x * y.z + w.y, k[7] = x.y * y.z - w.x, k[8] = x.z * y.z;
}

}  // namespace

double add_spring_gradient(const SpringLoop& loop, std::span<const Vec3> position, double scale,
                           std::span<Vec3> gradient) {
  return with_exponent(loop.exponent, [&]<int p>() {
    return in_sections(loop, [&](const Section& rows) {
      return spring_gradient<p>(loop, rows, position, scale, gradient);
    });
  });
}

double add_edge_gradient(const EdgeLoop& loop, std::span<const Vec3> position, double scale,
                         std::span<Vec3> gradient) {
  return in_sections(loop, [&](const Section& rows) {
    return edge_gradient(loop, rows, position, scale, gradient);
  });
}

VolumeLaw volume_law(const Weights& weights, double volume, double compliance,
                     double target_volume) {
  const double stiffness = volume_stiffness(weights, compliance), change = volume - target_volume;
  return {0.5 * stiffness * change * change, stiffness * change, stiffness};
}

double add_prism_gradient(const PrismLoop& loop, std::span<const Vec3> position,
                          const Weights& weights, std::span<Vec3> gradient) {
  if (weights.volume == VolumeTerm::none) return 0;
  return in_sections(loop, [&](const Section& rows) {
    return prism_gradient(loop, rows, position, weights, gradient);
  });
}

double add_volume_gradient(const Loops& loops, std::span<const Vec3> position,
                           const Weights& weights, std::span<Vec3> gradient) {
  if (loops.nodal.empty()) return add_prism_gradient(loops.prisms, position, weights, gradient);
  const double weight = weights.volume_weight;
  return weight * add_nodal_gradient(loops.nodal, position, weight, gradient);
}

void add_hessian_action(const Loops& loops, std::span<const Vec3> position, const Weights& weights,
                        std::span<const Vec3> direction, std::span<Vec3> product,
                        std::span<const double> nodal_slopes, std::span<const double> max_slope) {
  for (const SpringLoop& loop : loops.springs)
    with_exponent(loop.exponent, [&]<int p>() {
      spring_action<p>(loop, position, weights.elastic, direction, product);
    });
  if (loops.edges.size() > 0) add_edge_gradient(loops.edges, direction, weights.elastic, product);
  if (weights.volume == VolumeTerm::none) return;
  if (loops.nodal.empty())
    prism_action(loops.prisms, position, weights, max_slope, direction, product);
  else
    add_nodal_action(loops.nodal, position, nodal_slopes, weights.volume_weight, direction,
                     product);
}

std::vector<double> semidefinite_slopes(const PrismLoop& loop, std::span<const Vec3> initial,
                                        std::span<const Vec3> position) {
  std::vector<double> slopes(loop.size(), 0.0);
  for (size_t e = 0; e < loop.shear_modulus.size(); ++e) {
    const Mat3 f = model::deformation_gradient(base::pick(initial, loop.points[e]),
                                               base::pick(position, loop.points[e]));
    Eigen::SelfAdjointEigenSolver<Mat3> squares;
    squares.computeDirect(f.transpose() * f, Eigen::EigenvaluesOnly);
    slopes[e] = loop.shear_modulus[e] / std::sqrt(squares.eigenvalues()[2]);
  }
  return slopes;
}

PrismBlocks prism_blocks(const std::array<Vec3, 6>& corners, const PrismTerm& term,
                         const Weights& weights, double max_slope) {
  const PrismEdges<double> edges(triples(corners));
  const PrismSlope<double> v(edges);
  const VolumeLaw law = volume_law(weights, v.volume, term.compliance, term.target_volume);
  const double slope = law.slope + weights.volume_weight * term.nodal_slope;
  const double curvature = law.curvature + weights.volume_weight * term.nodal_curvature;
  const double turning = std::clamp(slope, -max_slope, max_slope);
  const auto skew = prism_volume_hessian(edges);
  PrismBlocks blocks;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) {
      const Triple<double> bend = curvature * v.gradient[i], turn = turning * skew[i][j];
      set_block(blocks[i][j], bend, v.gradient[j], turn);
      if (i != j) set_block(blocks[j][i], v.gradient[j], bend, -turn);
    }
  return blocks;
}

namespace {

double solid_energy(const EdgeLoop& edges, const PrismLoop& prisms,
                    std::span<const Vec3> position) {
  double energy = 0;
  for (int64_t e = 0; e < edges.counted; ++e) {
    const auto [i, j] = edges.points[e];
    energy += 0.5 * edges.weight[e] * (position[j] - position[i]).squaredNorm();
  }
  for (int64_t e = 0; e < prisms.counted; ++e) {
    const double v = prism_volume(base::pick(position, prisms.points[e]).data());
    const double beyond = v - prisms.target_volume[e];
    energy += 0.5 * beyond * beyond / prisms.compliance[e];
  }
  return energy;
}

}  // namespace

Totals totals(const Loops& loops, std::span<const Vec3> position, BonePoses poses) {
  Totals sum;
  for (const SpringLoop& loop : loops.springs)
    with_exponent(loop.exponent, [&]<int p>() {
      for (int64_t e = 0; e < loop.counted; ++e) {
        const auto [i, j] = loop.points[e];
        const double s = (position[j] - position[i]).norm() - loop.rest_length[e];
        sum.spring_energy += spring_energy<p>(s, loop.stiffness[e], loop.inverse_reference[e]);
      }
    });
  if (loops.solid()) {
    sum.solid_energy =
        solid_energy(loops.edges, loops.prisms, position) + nodal_energy(loops.nodal, position);
    sum.fixed_energy = solid_energy(loops.fixed_edges, loops.fixed_prisms, position);
  }
  for (const TermLoop& loop : loops.terms) sum.term_energy += loop.value(position, poses);
  for (int64_t e = 0; e < loops.prisms.counted; ++e) {
    const double v = prism_volume(base::pick(position, loops.prisms.points[e]).data());
    const double v0 = loops.prisms.rest_volume[e], change = v - v0;
    sum.volume_squares += change * change;
    sum.penalty_unit += 0.5 * change * change / v0;
    sum.volume_error_max = std::max(sum.volume_error_max, std::abs(v / v0 - 1));
    if (!(v > 0)) ++sum.inverted;
  }
  return sum;
}

}  // namespace repose::mechanics
