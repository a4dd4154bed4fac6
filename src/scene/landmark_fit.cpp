#include "landmark_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "repose/base/error.h"

namespace repose::scene {
namespace {

/// The least turn that takes direction `from` to `to`, and the middle of one pair to the other's.
RigidMotion line_up(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  const Vec3 a = from[1] - from[0], b = to[1] - to[0];
  if (!(a.norm() > 0) || !(b.norm() > 0))
    base::refuse("two landmarks in one place fix no turn; give two apart");
  const Vec3 axis = a.cross(b).norm() > 0 ? a.cross(b).normalized() : a.unitOrthogonal();
  const Mat3 turn =
      Eigen::AngleAxisd(std::atan2(a.cross(b).norm(), a.dot(b)), axis).toRotationMatrix();
  Mat4 matrix = Mat4::Identity();
  matrix.topLeftCorner<3, 3>() = turn;
  matrix.topRightCorner<3, 1>() = (to[0] + to[1] - turn * (from[0] + from[1])) / 2;
  return RigidMotion::from_matrix(matrix);
}

}  // namespace

RigidFit fit_landmarks(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  if (from.size() != to.size() || from.empty())
    throw base::InternalError("landmarks to fit are not in pairs");
  if (from.size() > 2) return fit_rigid_motion(from, to);
  RigidFit fit{from.size() == 1 ? RigidMotion::translation(to[0] - from[0]) : line_up(from, to), 0};
  for (std::size_t i = 0; i < from.size(); ++i)
    fit.residual = std::max(fit.residual, (fit.motion.apply(from[i]) - to[i]).norm());
  return fit;
}

}  // namespace repose::scene
