#include "repose/scene/placement.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace repose::scene {

namespace {

constexpr double degree = std::numbers::pi / 180;

}  // namespace

RigidMotion motion_of(const Placement& placement, const Vec3& centroid) {
  const RigidMotion shift = RigidMotion::translation(placement.translation);
  const double angle = placement.rotation.norm();
  if (!(angle > 0)) return shift;
  return shift.after(RigidMotion::rotation(placement.rotation, centroid, angle));
}

Placement placement_of(const RigidMotion& motion, const Vec3& centroid) {
  const Eigen::AngleAxisd turn(Mat3(motion.matrix().topLeftCorner<3, 3>()));
  return {motion.apply(centroid) - centroid, turn.angle() / degree * turn.axis()};
}

Vec3 centroid(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (const auto& [a, b, c] : triangles) {
    const Vec3 &x = points[a], &y = points[b], &z = points[c];
    const double part = (y - x).cross(z - x).norm();
    sum += part * (x + y + z) / 3;
    area += part;
  }
  return area > 0 ? Vec3(sum / area) : points.empty() ? Vec3(Vec3::Zero()) : points.front();
}

std::string outside_box(const Placement& placement, const Plan& plan) {
  constexpr double rounding = 1e-9;  // mm, degrees
  const auto find = [](const Vec3& value, const Vec3& range, const char* what, const char* unit) {
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(value[a]) <= range[a] + rounding))
        return fmt::format("{} {:g} {} along {} is outside −{:g} … {:g}", what, value[a], unit,
                           "xyz"[a], range[a], range[a]);
    return std::string();
  };
  const std::string shift = find(placement.translation, plan.translate, "translation", "mm");
  return shift.empty() ? find(placement.rotation, plan.rotate, "rotation", "degrees") : shift;
}

}  // namespace repose::scene
