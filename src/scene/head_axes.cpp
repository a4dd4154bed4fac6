#include "head_axes.h"

#include <Eigen/Geometry>

#include "repose/base/error.h"

namespace repose::scene {

Vec3 require_landmark(const Landmarks& landmarks, const std::string& name,
                      const std::string& file) {
  const auto found = landmarks.find(name);
  if (found == landmarks.end())
    base::refuse("{}: landmark {} is missing; repose-landmarks proposes it", file, name);
  return found->second;
}

HeadAxes head_axes(const Landmarks& landmarks, const std::string& file) {
  const Vec3 left = (require_landmark(landmarks, "condyle_left_center", file) -
                     require_landmark(landmarks, "condyle_right_center", file))
                        .normalized();
  const Vec3 back = (Vec3::UnitY() - left.y() * left).normalized();
  return {left, back, left.cross(back)};
}

}  // namespace repose::scene
