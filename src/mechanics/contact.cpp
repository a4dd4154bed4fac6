#include "repose/mechanics/contact.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace repose::mechanics {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// The curvature that a semidefinite relative keeps: a concave body's.
Mat3 negative_part(const Mat3& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(symmetric);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMin(0.0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

BodyContact::BodyContact(const model::ContactPairs& pairs, double stiffness,
                         std::vector<RigidBody> bodies)
    : pairs_(pairs), bodies_(std::move(bodies)) {
  reset(stiffness);
}

void BodyContact::reset(double stiffness) {
  const size_t count = pairs_.point.size();
  stiffness_ = stiffness;
  multiplier_.assign(count, 0.0);
  released_.assign(count, 0);
  seen_.assign(count, Vec3::Zero());
  distance_.assign(count, -infinite);
  gap_.assign(count, infinite);
  normal_.assign(count, Vec3::Zero());
  curvature_.assign(count, Mat3::Zero());
  acting_.clear();
}

/// True if the surfaces that two constraints are beside face each other, at the latest update.
bool BodyContact::face(size_t c, size_t d) const {
  constexpr double facing = -0.9;  // cosine of the angle of normals
  return normal_[c].dot(normal_[d]) < facing * normal_[c].norm() * normal_[d].norm();
}

std::vector<std::pair<size_t, size_t>> BodyContact::overlapped() const {
  constexpr double overlap = 1e-3;  // mm, above what rounding leaves of bodies that touch
  std::vector<size_t> near;
  for (size_t c = 0; c < gap_.size(); ++c)
    if (!released(c) && std::isfinite(gap_[c])) near.push_back(c);
  std::ranges::stable_sort(near, {}, [this](size_t c) { return pairs_.point[c]; });
  std::vector<std::pair<size_t, size_t>> found;
  for (auto c = near.begin(); c != near.end(); ++c)
    for (auto d = c + 1; d != near.end() && pairs_.point[*d] == pairs_.point[*c]; ++d)
      if (gap_[*c] + gap_[*d] < -overlap && face(*c, *d)) found.emplace_back(*c, *d);
  return found;
}

bool BodyContact::release_overlapped() {
  const auto pairs = overlapped();
  for (const auto& [first, second] : pairs) {
    const size_t c = slides(second) && !slides(first) ? first : second;
    released_[c] = 1;
    multiplier_[c] = 0;
  }
  return !pairs.empty();
}

double BodyContact::min_gap(size_t c, const Vec3& beside) const {
  constexpr double steepest = 1.1;  // of a distance read from a grid
  return distance_[c] - steepest * (beside - seen_[c]).norm() - pairs_.offset[c];
}

/// True if the gap is at least `gap` mm: by the way since it was last evaluated, or else by a lower
/// bound, which is kept.
bool BodyContact::stays_above(double gap, size_t c, const Vec3& beside) {
  constexpr double margin = 0.5;  // mm, by which a rough bound exceeds what is needed
  if (min_gap(c, beside) >= gap) return true;
  const double needed = gap + pairs_.offset[c];
  const double bound = bodies_[pairs_.body[c]].lower_bound(beside, needed + margin);
  if (bound < needed) return false;
  seen_[c] = beside;
  distance_[c] = bound;
  return true;
}

void BodyContact::set(size_t c, const Vec3& beside, const surface::Distance& distance) {
  seen_[c] = beside;
  distance_[c] = distance.value;
  gap_[c] = distance.value - pairs_.offset[c];
  normal_[c] = distance.gradient;
  curvature_[c] = distance.curvature;
}

void BodyContact::measure(size_t c, const Vec3& beside) {
  set(c, beside, bodies_[pairs_.body[c]].distance(beside));
}

void BodyContact::update_gaps(std::span<const Vec3> position) {
  acting_.clear();
  for (size_t c = 0; c < pairs_.point.size(); ++c) {
    const Vec3 beside = bodies_[pairs_.body[c]].beside(position[pairs_.point[c]]);
    if (!slides(c) && stays_above(multiplier_[c] / stiffness_, c, beside)) {
      gap_[c] = min_gap(c, beside);
      continue;
    }
    measure(c, beside);
    if (now(c).stiffness != 0) acting_.push_back(c);
  }
}

/// False if the gap is at least `reach` mm; evaluates it otherwise.
bool BodyContact::measure_within(double reach, double smoothed_to, size_t c, const Vec3& beside) {
  if (min_gap(c, beside) > reach) return false;
  const RigidBody& body = bodies_[pairs_.body[c]];
  const double bound = body.lower_bound(beside, reach + pairs_.offset[c]);
  if (bound - pairs_.offset[c] >= reach) {
    seen_[c] = beside;
    distance_[c] = bound;
    return false;
  }
  const bool smoothed = multiplier_[c] != 0 || bound < exact_from(c, smoothed_to);
  set(c, beside, smoothed ? body.distance(beside) : body.outside(beside));
  return gap_[c] <= reach;
}

std::vector<LinearGap> BodyContact::linear_gaps(std::span<const Vec3> position, double reach,
                                                double smoothed_to) {
  std::vector<LinearGap> gaps;
  for (size_t c = 0; c < pairs_.point.size(); ++c) {
    if (released(c)) continue;
    const Vec3 beside = bodies_[pairs_.body[c]].beside(position[pairs_.point[c]]);
    if (slides(c))
      measure(c, beside);
    else if (!measure_within(reach, smoothed_to, c, beside))
      continue;
    if (normal_[c].isZero(0)) continue;
    const auto point = static_cast<int32_t>(pairs_.point[c]);
    gaps.push_back({c, slides(c), pairs_.area[c], gap_[c], {{point, normal_[c]}}, {}});
  }
  return gaps;
}

namespace {

/// Steps from a point to places where a body's other side may be nearest, mm.
std::vector<Vec3> steps_around() {
  std::vector<Vec3> steps;
  for (int n = 0; n < 27; ++n) {
    const Vec3 way(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if (way.isZero(0)) continue;
    for (const double radius : {1.0, 2.0, 3.0}) steps.push_back(radius * way.normalized());
  }
  return steps;
}

}  // namespace

/// The gaps to first order of a constraint's point to tangent planes of its body around it, at most
/// `deepest` mm deep, whose normals are more than 60° from the one at the latest update.
std::vector<LinearGap> BodyContact::gaps_round_edge(size_t c, std::span<const Vec3> position,
                                                    double deepest) const {
  constexpr double largest_cosine = 0.5;
  static const std::vector<Vec3> steps = steps_around();
  const RigidBody& body = bodies_[pairs_.body[c]];
  const auto point = static_cast<int32_t>(pairs_.point[c]);
  const Vec3 beside = body.beside(position[point]);
  std::vector<LinearGap> gaps;
  for (const Vec3& step : steps) {
    const surface::Distance there = body.distance(beside + body.own_direction(step));
    if (std::abs(there.value) > step.norm() || !(there.gradient.dot(normal_[c]) < largest_cosine))
      continue;
    const double gap = there.value - there.gradient.dot(step) - pairs_.offset[c];
    if (gap < 0 && gap > -deepest)
      gaps.push_back({c, false, pairs_.area[c], gap, {{point, there.gradient.normalized()}}, {}});
  }
  return gaps;
}

std::set<int32_t> BodyContact::bodies_near_edges(std::span<const Vec3> position) const {
  constexpr double near = 2;  // mm
  std::set<int32_t> found;
  for (size_t c = 0; c < pairs_.point.size(); ++c) {
    const bool touches = multiplier_[c] > 0 || slides(c);
    if (!touches || normal_[c].isZero(0) || found.contains(pairs_.body[c])) continue;
    if (!gaps_round_edge(c, position, near).empty()) found.insert(pairs_.body[c]);
  }
  return found;
}

std::vector<LinearGap> BodyContact::other_sides(std::span<const Vec3> position) const {
  std::vector<LinearGap> found;
  for (size_t c = 0; c < pairs_.point.size(); ++c) {
    if (multiplier_[c] <= 0 || slides(c) || normal_[c].isZero(0)) continue;
    std::ranges::move(gaps_round_edge(c, position), std::back_inserter(found));
  }
  return found;
}

std::vector<LinearGap> BodyContact::ways_out(std::span<const Vec3> position) const {
  std::vector<LinearGap> found;
  for (const auto& [first, second] : overlapped()) {
    std::vector<LinearGap> ways = gaps_round_edge(first, position);
    std::ranges::move(gaps_round_edge(second, position), std::back_inserter(ways));
    const auto nearest = std::ranges::max_element(ways, {}, &LinearGap::gap);
    if (nearest != ways.end()) found.push_back(*nearest);
  }
  return found;
}

void BodyContact::carry(std::span<const Vec3> position, std::span<const RigidBody> before,
                        std::vector<LinearGap>& gaps) const {
  for (LinearGap& g : gaps) {
    const int32_t body = pairs_.body[g.constraint];
    auto& [point, normal] = g.gradient.front();
    normal = bodies_[body].turned(before[body].own_direction(normal));
    g.gap += normal.dot(position[point] - bodies_[body].in_space(seen_[g.constraint]));
  }
}

double BodyContact::measure_gap(size_t c, std::span<const Vec3> position) {
  const RigidBody& body = bodies_[pairs_.body[c]];
  const Vec3 beside = body.beside(position[pairs_.point[c]]);
  const bool away = !slides(c) && body.lower_bound(beside, 0) >= 0;
  set(c, beside, away ? body.outside(beside) : body.distance(beside));
  return gap_[c];
}

void BodyContact::update_all_gaps(std::span<const Vec3> position) {
  update_gaps(position);
  for (size_t c = 0; c < pairs_.point.size(); ++c) measure_gap(c, position);
}

double BodyContact::add_gradient(std::span<const Vec3> position, double scale,
                                 std::span<Vec3> gradient) {
  update_gaps(position);
  double value = 0;
  for (size_t c = 0; c < multiplier_.size(); ++c) value += pairs_.area[c] * now(c).value;
  for (const size_t c : acting_)
    gradient[pairs_.point[c]] -= scale * pairs_.area[c] * now(c).pressure * normal_[c];
  return value;
}

Mat3 BodyContact::block(size_t c, bool exact, const Pressing& pressing) const {
  Mat3 bend = pressing.pressure * curvature_[c];
  if (!exact) bend = negative_part(bend);
  return pairs_.area[c] * (pressing.stiffness * normal_[c] * normal_[c].transpose() - bend);
}

}  // namespace repose::mechanics
