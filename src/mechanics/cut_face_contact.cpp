#include "repose/mechanics/cut_face_contact.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <tuple>

namespace repose::mechanics {

namespace {

/// Adds a weight to a control, those beyond the ends in a straight line with the last two.
void fold(int control, int controls, double weight, int first, std::array<double, 4>& of) {
  const int beyond = control < 0 ? -control : control - (controls - 1);
  if (beyond <= 0) {
    of[control - first] += weight;
    return;
  }
  const int end = control < 0 ? 0 : controls - 1, next = control < 0 ? 1 : controls - 2;
  of[end - first] += (beyond + 1) * weight;
  of[next - first] -= beyond * weight;
}

}  // namespace

SplineWeights spline_weights(double at, int controls) {
  const int span = static_cast<int>(std::floor(at));
  const double s = at - span, t = 1 - s;
  const std::array<std::array<double, 4>, 3> uniform = {{
      {t * t * t / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, (4 - 6 * t * t + 3 * t * t * t) / 6,
       s * s * s / 6},
      {-t * t / 2, (3 * s - 4) * s / 2, (4 - 3 * t) * t / 2, s * s / 2},
      {t, 3 * s - 2, 3 * t - 2, s},
  }};
  SplineWeights weights;
  weights.count = std::min(4, controls);
  weights.first = std::clamp(span - 1, 0, controls - weights.count);
  for (int order = 0; order < 3; ++order)
    for (int k = 0; k < 4; ++k)
      fold(span - 1 + k, controls, uniform[order][k], weights.first, weights.of[order]);
  return weights;
}

CutFaceContact::Patch::Patch(const Net& net, const Eigen::Vector2d& at)
    : rows(net.rows),
      along(spline_weights(at[0], net.columns)),
      inwards(spline_weights(at[1], net.rows)) {}

CutFaceContact::Patch::Patch(const Net& net, const std::vector<Vec3>& controls,
                             const Eigen::Vector2d& at)
    : Patch(net, at) {
  point = sum(controls, 0, 0);
  first = sum(controls, 1, 0);
  second = sum(controls, 0, 1);
  first_first = sum(controls, 2, 0);
  first_second = sum(controls, 1, 1);
  second_second = sum(controls, 0, 2);
}

Vec3 CutFaceContact::Patch::sum(const std::vector<Vec3>& controls, int d_along,
                                int d_inwards) const {
  Vec3 total = Vec3::Zero();
  for_each(d_along, d_inwards,
           [&](int control, double weight) { total += weight * controls[control]; });
  return total;
}

Eigen::Matrix2d CutFaceContact::Patch::metric() const {
  Eigen::Matrix2d m;
  m << first.dot(first), first.dot(second), first.dot(second), second.dot(second);
  return m;
}

Eigen::Matrix2d CutFaceContact::Patch::bend(const Vec3& offset) const {
  Eigen::Matrix2d b;
  b << offset.dot(first_first), offset.dot(first_second), offset.dot(first_second),
      offset.dot(second_second);
  return b;
}

CutFaceContact::CutFaceContact(const model::CutFaces& cut_faces, double stiffness)
    : stiffness_(stiffness) {
  size_t first = 0, place = 0;
  for (size_t cut = 0; cut < cut_faces.size.size(); ++cut) {
    const auto rows = static_cast<size_t>(cut_faces.size[cut][1]);
    const size_t count = static_cast<size_t>(cut_faces.size[cut][0]) * rows;
    add_net(cut_faces, cut, first);
    add_net(cut_faces, cut, first + count);
    for (size_t c = 0; c < count; ++c, ++place) {
      const size_t column = c / rows, row = c % rows;
      if (cut_faces.area[place] > 0)
        add_place(cut_faces.point[cut_faces.begin[first + c]], cut_faces.area[place],
                  {static_cast<double>(column), static_cast<double>(row)});
    }
    link(nets_[nets_.size() - 2], nets_.back());
    first += 2 * count;
  }
  base::sort_unique(links_);
  multiplier_.assign(places_.size(), 0.0);
  feet_.resize(places_.size());
}

void CutFaceContact::add_net(const model::CutFaces& cut_faces, size_t cut, size_t first) {
  Net& net = nets_.emplace_back();
  net.columns = static_cast<int>(cut_faces.size[cut][0]);
  net.rows = static_cast<int>(cut_faces.size[cut][1]);
  for (size_t c = first; c < first + static_cast<size_t>(net.columns) * net.rows; ++c) {
    auto& shares = net.controls.emplace_back();
    for (auto k = cut_faces.begin[c]; k < cut_faces.begin[c + 1]; ++k)
      shares.emplace_back(static_cast<int32_t>(cut_faces.point[k]), cut_faces.weight[k]);
  }
}

/// A place of the last net but one, against the last.
void CutFaceContact::add_place(int64_t point, double area, const Eigen::Vector2d& at) {
  const Net& own = nets_[nets_.size() - 2];
  std::map<int32_t, double> shares;
  Patch(own, at).for_each(0, 0, [&](int control, double weight) {
    if (weight != 0)
      for (const auto& [p, share] : own.controls[control]) shares[p] += weight * share;
  });
  places_.push_back({nets_.size() - 1,
                     point,
                     area,
                     {shares.begin(), shares.end()},
                     static_cast<int>(at[0]),
                     static_cast<int>(at[1])});
}

void CutFaceContact::link(const Net& own, const Net& other) {
  constexpr int reach = 4;  // columns, by which sides slide along each other
  std::vector<std::vector<int32_t>> points(own.columns);
  for (int c = 0; c < own.columns; ++c) {
    for (const Net* net : {&own, &other})
      for (int row = 0; row < own.rows; ++row)
        for (const auto& [p, share] : net->controls[c * own.rows + row]) points[c].push_back(p);
    base::sort_unique(points[c]);
  }
  for (int c = 0; c < own.columns; ++c)
    for (int d = std::max(0, c - reach); d < std::min(own.columns, c + reach + 1); ++d)
      for (const int32_t p : points[c])
        for (const int32_t q : points[d])
          if (p < q) links_.push_back({p, q});
}

namespace {

/// Returns Newton's step towards the place of a patch that is nearest to `offset` beyond its point;
/// parameters at an end, `minimum` or `maximum`, that the nearest place lies beyond stay.
template <class Patch>
Eigen::Vector2d step_to_nearest(const Patch& patch, const Vec3& offset,
                                const Eigen::Vector2d& where, const Eigen::Vector2d& minimum,
                                const Eigen::Vector2d& maximum) {
  const Eigen::Vector2d slope(patch.first.dot(offset), patch.second.dot(offset));
  Eigen::Matrix2d bend = patch.metric() - patch.bend(offset);
  const auto held = [&](int d) {
    return slope[d] < 0 ? where[d] <= minimum[d] : where[d] >= maximum[d];
  };
  if (held(0) || held(1)) {
    const int d = held(0) ? 1 : 0;
    Eigen::Vector2d step = Eigen::Vector2d::Zero();
    if (!held(d)) step[d] = slope[d] / (bend(d, d) > 0 ? bend(d, d) : patch.metric()(d, d));
    return step;
  }
  if (!(bend(0, 0) > 0 && bend.determinant() > 0)) bend = patch.metric();
  Eigen::Vector2d step = bend.inverse() * slope;
  for (const int d : {0, 1}) {
    const double beyond =
        where[d] + step[d] - std::clamp(where[d] + step[d], minimum[d], maximum[d]);
    if (beyond == 0) continue;
    step[d] -= beyond;
    step[1 - d] = (slope[1 - d] - bend(0, 1) * step[d]) / bend(1 - d, 1 - d);
    break;
  }
  return step;
}

/// Returns the place of a net's surface that is nearest to `at`, by Newton's method; whether that
/// is not its end. `evaluate` returns the surface at a place.
template <class Net, class Evaluate>
auto nearest_place(const Net& net, Eigen::Vector2d where, const Vec3& at, Evaluate&& evaluate) {
  constexpr int max_steps = 60, max_halved = 20;
  constexpr double longest = 0.5, exact = 1e-13;  // of a patch
  const Eigen::Vector2d minimum = net.begin(), maximum = net.end();
  auto patch = evaluate(where);
  for (int n = 0; n < max_steps; ++n) {
    const Vec3 offset = at - patch.point;
    Eigen::Vector2d step = step_to_nearest(patch, offset, where, minimum, maximum);
    if (!step.allFinite()) break;
    step *= std::min(1.0, longest / std::max(step.cwiseAbs().maxCoeff(), exact));
    Eigen::Vector2d next = (where + step).cwiseMax(minimum).cwiseMin(maximum);
    auto there = evaluate(next);
    for (int k = 0; k < max_halved && (at - there.point).squaredNorm() > offset.squaredNorm();
         ++k) {
      next = (where + next) / 2;
      there = evaluate(next);
    }
    const double moved = (next - where).cwiseAbs().maxCoeff();
    where = next;
    patch = there;
    if (moved < exact) break;
  }
  return std::pair(patch, (where - minimum).minCoeff() > 0 && (maximum - where).minCoeff() > 0);
}

/// Returns the nearest of the places that nearest_place() finds from `starts`. On a surface bent
/// round an edge these may be different ones.
template <class Patch, class Net, class Evaluate>
std::pair<Patch, bool> nearest_foot(const Net& net, const std::vector<Eigen::Vector2d>& starts,
                                    const Vec3& at, Evaluate&& evaluate) {
  std::pair<Patch, bool> nearest;
  double distance = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& start : starts) {
    auto found = nearest_place(net, start, at, evaluate);
    const double there = (at - found.first.point).norm();
    if (!(there >= distance)) std::tie(nearest, distance) = std::pair(std::move(found), there);
  }
  return nearest;
}

}  // namespace

std::vector<CutFaceContact::Touched> CutFaceContact::touched(size_t w) const {
  std::map<int32_t, Eigen::Matrix<double, 3, 5>> touched;
  const auto at_point = [&](int32_t p) -> Eigen::Matrix<double, 3, 5>& {
    return touched.try_emplace(p, Eigen::Matrix<double, 3, 5>::Zero()).first->second;
  };
  const Foot& foot = feet_[w];
  Eigen::Matrix3d axes;
  axes << foot.normal, foot.patch.first, foot.patch.second;
  const auto& controls = nets_[places_[w].net].controls;
  for (const auto& [p, share] : places_[w].shares) at_point(p).leftCols<3>() += share * axes;
  foot.patch.for_each(0, 0, [&](int control, double weight) {
    for (const auto& [p, share] : controls[control])
      at_point(p).leftCols<3>() -= weight * share * axes;
  });
  for (int d = 0; d < 2; ++d)
    foot.patch.for_each(1 - d, d, [&](int control, double weight) {
      for (const auto& [p, share] : controls[control])
        at_point(p).col(3 + d) += weight * share * foot.normal;
    });
  return {touched.begin(), touched.end()};
}

CutFaceContact::Samples::Samples(const Net& net, const std::vector<Vec3>& controls) {
  for (double i = net.begin()[0]; i <= net.end()[0]; i += step)
    for (double j = net.begin()[1]; j <= net.end()[1]; j += step)
      point.push_back(Patch(net, {i, j}).sum(controls, 0, 0));
  rows = static_cast<int>((net.end() - net.begin())[1] / step) + 1;
  columns = static_cast<int>(point.size()) / rows;
}

std::vector<Eigen::Vector2d> CutFaceContact::Samples::near(const Vec3& at) const {
  constexpr double times = 2;  // the least distance
  std::vector<double> square;
  for (const Vec3& p : point) square.push_back((p - at).squaredNorm());
  const double largest = times * times * *std::ranges::min_element(square);
  const auto is_least = [&](int sample) {
    const int i = sample / rows, j = sample % rows;
    return !((i > 0 && square[sample - rows] < square[sample]) ||
             (i + 1 < columns && square[sample + rows] < square[sample]) ||
             (j > 0 && square[sample - 1] < square[sample]) ||
             (j + 1 < rows && square[sample + 1] < square[sample]));
  };
  std::vector<Eigen::Vector2d> found;
  for (int sample = 0; sample < columns * rows; ++sample)
    if (square[sample] <= largest && is_least(sample))
      found.push_back(Net::begin() + step * Eigen::Vector2d(sample / rows, sample % rows));
  if (found.empty()) found.push_back({0, 0});  // at positions that are not finite
  return found;
}

void CutFaceContact::update_gaps(std::span<const Vec3> position) {
  const auto mean = [&](const std::vector<Share>& shares) {
    Vec3 sum = Vec3::Zero();
    for (const auto& [p, share] : shares) sum += share * position[p];
    return sum;
  };
  std::vector<std::vector<Vec3>> means(nets_.size() + 1);
  for (size_t n = 0; n < nets_.size(); ++n)
    std::ranges::transform(nets_[n].controls, std::back_inserter(means[n]), mean);
  std::ranges::transform(places_, std::back_inserter(means.back()), mean, &Place::shares);
  if (means == means_) return;
  means_ = std::move(means);
  Samples samples;
  for (size_t w = 0; w < places_.size(); ++w) {
    const Place& place = places_[w];
    const Net& net = nets_[place.net];
    const std::vector<Vec3>& controls = means_[place.net];
    if (w == 0 || places_[w - 1].net != place.net) samples = Samples(net, controls);
    const Vec3& at = means_.back()[w];
    const auto [patch, opposite] = nearest_foot<Patch>(
        net, samples.near(at), at,
        [&](const Eigen::Vector2d& where) { return Patch(net, controls, where); });
    const Vec3 across = patch.first.cross(patch.second), offset = at - patch.point;
    Foot& foot = feet_[w];
    foot.patch = patch;
    foot.normal = across.normalized();
    foot.opposite = opposite && across.norm() > 0;
    foot.gap = foot.opposite ? foot.normal.dot(offset) : offset.norm();
  }
}

Pressing CutFaceContact::now(size_t w) const {
  const double far = std::numeric_limits<double>::max();
  return press(feet_[w].opposite ? feet_[w].gap : far, multiplier_[w], stiffness_, false);
}

double CutFaceContact::add_gradient(std::span<const Vec3> position, double scale,
                                    std::span<Vec3> gradient) {
  update_gaps(position);
  double value = 0;
  for (size_t w = 0; w < places_.size(); ++w) {
    const Pressing pressing = now(w);
    value += places_[w].area * pressing.value;
    if (pressing.pressure == 0) continue;
    const Vec3 push = scale * places_[w].area * pressing.pressure * feet_[w].normal;
    for (const auto& [p, share] : places_[w].shares) gradient[p] -= share * push;
    feet_[w].patch.for_each(0, 0, [&](int control, double weight) {
      for (const auto& [p, share] : nets_[places_[w].net].controls[control])
        gradient[p] += weight * share * push;
    });
  }
  return value;
}

std::vector<LinearGap> CutFaceContact::linear_gaps(double reach) const {
  std::vector<LinearGap> gaps;
  for (size_t w = 0; w < places_.size(); ++w) {
    const Foot& foot = feet_[w];
    if (!foot.opposite || foot.gap > reach) continue;
    LinearGap& gap = gaps.emplace_back(LinearGap{w, false, places_[w].area, foot.gap, {}, {}});
    for (const auto& [p, at_p] : touched(w)) gap.gradient.emplace_back(p, at_p.col(0));
    gap.lumped = lumped(w);
  }
  return gaps;
}

/// The gap's gradient as that between one layer of either side, the one that counts most: spread
/// over several, a preconditioner that couples neighbors only would keep but a part of it.
LinearGap::Gradient CutFaceContact::lumped(size_t w) const {
  std::map<int32_t, double> share;
  const auto add = [&](const Net& net, const SplineWeights& along, int row, double scale) {
    const auto control = [&](int k) { return net.controls.begin() + (along.first + k) * net.rows; };
    const int inwards = row < net.rows / 2 ? 1 : -1;
    while (control(0)[row].size() > 1) row += inwards;  // round an edge, of several points
    for (int k = 0; k < along.count; ++k)
      share[control(k)[row].front().first] += scale * along.of[0][k];
  };
  const auto& [net, point, area, shares, column, row] = places_[w];
  const SplineWeights& inwards = feet_[w].patch.inwards;
  const auto heaviest = std::ranges::max_element(inwards.of[0]) - inwards.of[0].begin();
  add(nets_[net - 1], spline_weights(column, nets_[net - 1].columns), row, 1);
  add(nets_[net], feet_[w].patch.along, inwards.first + static_cast<int>(heaviest), -1);
  LinearGap::Gradient lumped;
  for (const auto& [p, of] : share)
    if (of != 0) lumped.emplace_back(p, of * feet_[w].normal);
  return lumped;
}

/// Returns the Hessian in the columns of Touched: a k ∂g ∂g − a p ∂²g, where with a = T·∂r,
/// e = n·∂S₂,
///     ∂²g = −aᵀ m⁻¹ κ A⁻¹ a − aᵀ A⁻¹ e − eᵀ A⁻¹ a − g eᵀ A⁻¹ e,   A = m − g κ.
CutFaceContact::Form CutFaceContact::bilinear(size_t w, const Pressing& pressing) const {
  const Foot& foot = feet_[w];
  Form form = Form::Zero();
  form(0, 0) = pressing.stiffness;
  const Eigen::Matrix2d metric = foot.patch.metric(), curvature = foot.patch.bend(foot.normal);
  const Eigen::Matrix2d inverse = (metric - foot.gap * curvature).inverse();
  form.block<2, 2>(1, 1) = pressing.pressure * metric.inverse() * curvature * inverse;
  form.block<2, 2>(1, 3) = form.block<2, 2>(3, 1) = pressing.pressure * inverse;
  form.block<2, 2>(3, 3) = pressing.pressure * foot.gap * inverse;
  return places_[w].area * form;
}

}  // namespace repose::mechanics
