#include "head_axes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "repose/base/error.h"

namespace repose::scene {

Vec3 require_landmark(const Landmarks& landmarks, const std::string& name,
                      const std::string& file) {
  const auto found = landmarks.find(name);
  if (found == landmarks.end())
    base::refuse("{}: landmark {} is missing; repose-landmarks proposes it", file, name);
  return found->second;
}

Mat3 head_axes(const Landmarks& landmarks) {
  constexpr double upright = 0.5;  // condyles at one place or one behind the other have no axes
  constexpr double rise = 14 * std::numbers::pi / 180;  // of both directions together
  const Vec3 *right = find(landmarks, "condyle_right_center"),
             *left = find(landmarks, "condyle_left_center"),
             *nasion = find(landmarks, "nasion_bone"),
             *edge = find(landmarks, "upper_incisor_edge");
  if (!right || !left) return Mat3::Identity();
  Mat3 axes;
  axes.row(0) = (*left - *right).normalized();
  axes.row(1) = (Vec3::UnitY() - axes(0, 1) * axes.row(0).transpose()).normalized();
  axes.row(2) = axes.row(0).cross(axes.row(1));
  if (!(axes.determinant() > upright)) return Mat3::Identity();
  if (!nasion || !edge) return axes;
  const auto angle = [&](const Vec3& at) {
    const Vec3 way = axes * (at - (*right + *left) / 2);
    return std::atan2(way.z(), -way.y());
  };
  const double chin_up = (angle(*nasion) + angle(*edge) - rise) / 2;
  return Eigen::AngleAxisd(chin_up, Vec3::UnitX()).toRotationMatrix() * axes;
}

HeadAxes require_axes(const AnatomyPlan& plan) {
  for (const char* name : {"condyle_right_center", "condyle_left_center"})
    require_landmark(plan.landmarks, name, plan.file.string());
  return {plan.axes.row(0), plan.axes.row(1), plan.axes.row(2)};
}

}  // namespace repose::scene
