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

/// The point of a triangle closest to `query` by the weights of its corners (Ericson, Real-Time
/// Collision Detection, 5.1.5).
Vec3 closest_weights(const Vec3& query, const std::array<Vec3, 3>& x) {
  const Vec3 ab = x[1] - x[0], ac = x[2] - x[0], ap = query - x[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3 bp = query - x[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const Vec3 cp = query - x[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

}  // namespace

TouchLoop::TouchLoop(const model::Touches& touches, double stiffness, std::vector<RigidBody> bodies)
    : touches_(touches),
      stiffness_(stiffness),
      bodies_(std::move(bodies)),
      multiplier_(touches.point.size(), 0.0),
      seen_(touches.point.size(), Vec3::Zero()),
      distance_(touches.point.size(), -infinite),
      gap_(touches.point.size(), infinite),
      normal_(touches.point.size(), Vec3::Zero()) {}

double TouchLoop::least_gap(size_t c, const Vec3& beside) const {
  constexpr double steepest = 1.1;  // of a distance read from a grid
  return distance_[c] - steepest * (beside - seen_[c]).norm() - touches_.offset[c];
}

void TouchLoop::look(std::span<const Vec3> position) {
  acting_.clear();
  curvature_.clear();
  for (size_t c = 0; c < touches_.point.size(); ++c) {
    const Vec3 beside = bodies_[touches_.body[c]].beside(position[touches_.point[c]]);
    if (const double least = least_gap(c, beside);
        !slides(c) && !(multiplier_[c] - stiffness_ * least > 0)) {
      gap_[c] = least;
      continue;
    }
    const surface::Distance d = bodies_[touches_.body[c]].distance(beside);
    seen_[c] = beside;
    distance_[c] = d.value;
    gap_[c] = d.value - touches_.offset[c];
    normal_[c] = d.gradient;
    if (press(gap_[c], multiplier_[c], stiffness_, slides(c)).stiffness == 0) continue;
    acting_.push_back(c);
    curvature_.push_back(d.curvature);
  }
}

void TouchLoop::look_at_all(std::span<const Vec3> position) {
  std::fill(distance_.begin(), distance_.end(), -infinite);
  look(position);
}

double TouchLoop::add_gradient(std::span<const Vec3> position, double scale,
                               std::span<Vec3> gradient) {
  look(position);
  double value = 0;
  for (size_t c = 0; c < multiplier_.size(); ++c)
    if (multiplier_[c] > 0 && !slides(c))
      value -= touches_.area[c] * multiplier_[c] * multiplier_[c] / (2 * stiffness_);
  for (const size_t c : acting_) {
    const Pressing now = press(gap_[c], multiplier_[c], stiffness_, slides(c));
    const double before = slides(c) ? 0 : multiplier_[c] * multiplier_[c] / (2 * stiffness_);
    value += touches_.area[c] * (now.value + before);
    gradient[touches_.point[c]] -= scale * touches_.area[c] * now.pressure * normal_[c];
  }
  return value;
}

Mat3 TouchLoop::block(size_t c, bool exact) const {
  const auto place = std::lower_bound(acting_.begin(), acting_.end(), c) - acting_.begin();
  const Pressing now = press(gap_[c], multiplier_[c], stiffness_, slides(c));
  Mat3 bend = now.pressure * curvature_[place];
  if (!exact) bend = negative_part(bend);
  return touches_.area[c] * (now.stiffness * normal_[c] * normal_[c].transpose() - bend);
}

WallLoop::WallLoop(const model::Walls& walls, double stiffness)
    : walls_(walls), stiffness_(stiffness), pairs_(walls.point.size()) {
  for (size_t w = 0; w < pairs_.size(); ++w) {
    pairs_[w] = {{}, {}, Vec3::Zero(), 0, 0};
    pairs_[w].points.fill(static_cast<int32_t>(walls.point[w]));
  }
}

void WallLoop::pair(std::span<const Vec3> position, double anew) {
  std::vector<Vec3> normal(position.size(), Vec3::Zero());  // of the triangles' corners, by area
  const auto corners = [&](size_t t) -> std::array<Vec3, 3> {
    const auto& p = walls_.triangles[t];
    return {position[p[0]], position[p[1]], position[p[2]]};
  };
  for (size_t t = 0; t < walls_.triangles.size(); ++t) {
    const std::array<Vec3, 3> x = corners(t);
    for (const int64_t p : walls_.triangles[t]) normal[p] += (x[1] - x[0]).cross(x[2] - x[0]);
  }
  for (size_t w = 0; w < pairs_.size(); ++w) {
    WallPair& pair = pairs_[w];
    const Vec3& at = position[walls_.point[w]];
    double nearest = infinite;
    Vec3 foot = Vec3::Zero();
    for (size_t t = 0; t < walls_.triangles.size(); ++t) {
      if (walls_.triangle_cut[t] != walls_.cut[w]) continue;
      const std::array<Vec3, 3> x = corners(t);
      const Vec3 weight = closest_weights(at, x);
      const Vec3 point = weight[0] * x[0] + weight[1] * x[1] + weight[2] * x[2];
      if (!((point - at).squaredNorm() < nearest)) continue;
      nearest = (point - at).squaredNorm();
      foot = point;
      pair.share = {1, -weight[0], -weight[1], -weight[2]};
      for (int k = 0; k < 3; ++k) pair.points[k + 1] = static_cast<int32_t>(walls_.triangles[t][k]);
    }
    Vec3 mean = Vec3::Zero();
    for (int k = 1; k < 4; ++k) mean -= pair.share[k] * normal[pair.points[k]];
    const double size = mean.norm();
    if (size > 0) pair.normal = (anew * mean / size + (1 - anew) * pair.normal).normalized();
    // Opposite to the other side, or beyond its border by no more than about an edge, and somewhat
    // more once it is: a point that slips past must not come and go.
    const Vec3 way = at - foot;
    const double across = (way - way.dot(pair.normal) * pair.normal).norm();
    const double overhang = (pair.area > 0 ? 1.5 : 1.0) * std::sqrt(walls_.area[w]);
    const bool opposite = size > 0 && across <= std::abs(way.dot(pair.normal)) + overhang;
    pair.area = opposite ? walls_.area[w] : 0;
    if (!opposite) pair.multiplier = 0;
  }
}

double WallLoop::add_gradient(std::span<const Vec3> position, double scale,
                              std::span<Vec3> gradient) const {
  double value = 0;
  for (const WallPair& pair : pairs_) {
    if (pair.area == 0) continue;
    const Pressing now = press(pair.gap(position), pair.multiplier, stiffness_, false);
    value += pair.area * now.value;
    for (int k = 0; k < 4; ++k)
      gradient[pair.points[k]] -= scale * pair.area * now.pressure * pair.share[k] * pair.normal;
  }
  return value;
}

}  // namespace repose::mechanics
