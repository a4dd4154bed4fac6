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

TouchLoop::TouchLoop(const model::Touches& touches, double stiffness, std::vector<RigidBody> bodies)
    : touches_(touches),
      stiffness_(stiffness),
      bodies_(std::move(bodies)),
      multiplier_(touches.point.size(), 0.0),
      seen_(touches.point.size(), Vec3::Zero()),
      distance_(touches.point.size(), -infinite),
      gap_(touches.point.size(), infinite),
      normal_(touches.point.size(), Vec3::Zero()),
      curvature_(touches.point.size(), Mat3::Zero()) {}

double TouchLoop::least_gap(size_t c, const Vec3& beside) const {
  constexpr double steepest = 1.1;  // of a distance read from a grid
  return distance_[c] - steepest * (beside - seen_[c]).norm() - touches_.offset[c];
}

void TouchLoop::measure(size_t c, const Vec3& beside) {
  const surface::Distance d = bodies_[touches_.body[c]].distance(beside);
  seen_[c] = beside;
  distance_[c] = d.value;
  gap_[c] = d.value - touches_.offset[c];
  normal_[c] = d.gradient;
  curvature_[c] = d.curvature;
}

void TouchLoop::look(std::span<const Vec3> position) {
  acting_.clear();
  for (size_t c = 0; c < touches_.point.size(); ++c) {
    const Vec3 beside = bodies_[touches_.body[c]].beside(position[touches_.point[c]]);
    if (const double least = least_gap(c, beside);
        !slides(c) && !(multiplier_[c] - stiffness_ * least > 0)) {
      gap_[c] = least;
      continue;
    }
    measure(c, beside);
    if (now(c).stiffness != 0) acting_.push_back(c);
  }
}

std::vector<LinearGap> TouchLoop::linear_gaps(std::span<const Vec3> position, double reach) {
  std::vector<LinearGap> gaps;
  for (size_t c = 0; c < touches_.point.size(); ++c) {
    const Vec3 beside = bodies_[touches_.body[c]].beside(position[touches_.point[c]]);
    if (!slides(c) && least_gap(c, beside) > reach) continue;
    measure(c, beside);
    if ((!slides(c) && gap_[c] > reach) || normal_[c].isZero(0)) continue;
    gaps.push_back({c,
                    slides(c),
                    touches_.area[c],
                    gap_[c],
                    {{static_cast<int32_t>(touches_.point[c]), normal_[c]}},
                    {}});
  }
  return gaps;
}

std::vector<Vec3> TouchLoop::own_normals(std::span<const Vec3> position, double reach) const {
  std::vector<Vec3> normals(touches_.point.size(), Vec3::Zero());
  for (size_t c = 0; c < normals.size(); ++c) {
    const RigidBody& body = bodies_[touches_.body[c]];
    const Vec3 beside = body.beside(position[touches_.point[c]]);
    if (!slides(c) && least_gap(c, beside) > reach) continue;
    const surface::Distance d = body.distance(beside);
    if (d.value <= reach) normals[c] = body.own_direction(d.gradient);
  }
  return normals;
}

void TouchLoop::carry(std::span<const Vec3> position, std::vector<LinearGap>& gaps) const {
  for (LinearGap& g : gaps) {
    const RigidBody& body = bodies_[touches_.body[g.constraint]];
    auto& [point, normal] = g.gradient.front();
    normal = body.distance(seen_[g.constraint]).gradient;
    g.gap += normal.dot(position[point] - body.in_space(seen_[g.constraint]));
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

Mat3 TouchLoop::block(size_t c, bool exact, const Pressing& pressing) const {
  Mat3 bend = pressing.pressure * curvature_[c];
  if (!exact) bend = negative_part(bend);
  return touches_.area[c] * (pressing.stiffness * normal_[c] * normal_[c].transpose() - bend);
}

}  // namespace repose::mechanics
