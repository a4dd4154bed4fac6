#include "repose/scene/rigid_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "repose/base/error.h"

namespace repose::scene {

namespace {

constexpr double rigid_tolerance = 1e-6;

double defect(const Mat3& r) {
  return (r.transpose() * r - Mat3::Identity()).cwiseAbs().maxCoeff();
}

/// Polar factor by Newton–Schulz, R ← R (3I − RᵀR)/2: quadratic, and exact where R is already
/// right.
Mat3 orthonormal(Mat3 r) {
  for (int i = 0; i < 5 && defect(r) > 1e-15; ++i)
    r = 0.5 * r * (3.0 * Mat3::Identity() - r.transpose() * r);
  return r;
}

struct AxisAngle {
  Vec3 axis;
  double angle;  ///< radians, 0 … π
};

AxisAngle axis_angle(const Mat3& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() *= -1;
  const double sine = q.vec().stableNorm();
  if (sine == 0) return {Vec3::UnitX(), 0};
  Vec3 axis = q.vec() / sine;
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (q.w() < 1e-12 && axis[largest] < 0) axis = -axis;
  return {axis, 2 * std::atan2(sine, q.w())};
}

Mat3 turn(const Vec3& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

/// The least turn that takes direction `from` to `to`, and the middle of one pair to the other's.
RigidMotion line_up(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  const Vec3 a = from[1] - from[0], b = to[1] - to[0];
  if (!(a.norm() > 0) || !(b.norm() > 0))
    base::refuse("two landmarks in one place fix no turn; give two apart");
  const Vec3 axis = a.cross(b).norm() > 0 ? a.cross(b).normalized() : a.unitOrthogonal();
  const Mat3 rotation = turn(axis, std::atan2(a.cross(b).norm(), a.dot(b)));
  Mat4 matrix = Mat4::Identity();
  matrix.topLeftCorner<3, 3>() = rotation;
  matrix.topRightCorner<3, 1>() = (to[0] + to[1] - rotation * (from[0] + from[1])) / 2;
  return RigidMotion::from_matrix(matrix);
}

RigidFit with_residual(const RigidMotion& motion, const std::vector<Vec3>& from,
                       const std::vector<Vec3>& to) {
  RigidFit fit{motion, 0};
  for (std::size_t i = 0; i < from.size(); ++i)
    fit.residual = std::max(fit.residual, (motion.apply(from[i]) - to[i]).norm());
  return fit;
}

}  // namespace

RigidMotion::RigidMotion(const Mat3& rotation, const Vec3& translation)
    : rotation_(orthonormal(rotation)), translation_(translation) {}

RigidMotion RigidMotion::from_matrix(const Mat4& matrix) {
  if (!matrix.allFinite()) base::refuse("the matrix has an entry that is not a finite number");
  const Eigen::RowVector4d last_row(0, 0, 0, 1);
  const double off = (matrix.row(3) - last_row).cwiseAbs().maxCoeff();
  if (off > rigid_tolerance)
    base::refuse("the last row of the matrix must be 0 0 0 1, it is {:g} {:g} {:g} {:g}",
                 matrix(3, 0), matrix(3, 1), matrix(3, 2), matrix(3, 3));
  const Mat3 rotation = matrix.topLeftCorner<3, 3>();
  if (defect(rotation) > rigid_tolerance)
    base::refuse(
        "the matrix is not rigid: RᵀR differs from the identity by {:.2g}, allowed is {:g}; give a "
        "rotation without scale or shear, with all its digits",
        defect(rotation), rigid_tolerance);
  if (rotation.determinant() < 0)
    base::refuse("the matrix is a reflection (determinant −1); give a rotation");
  return {rotation, matrix.topRightCorner<3, 1>()};
}

RigidMotion RigidMotion::translation(const Vec3& vector_mm) {
  return {Mat3::Identity(), vector_mm};
}

RigidMotion RigidMotion::rotation(const Vec3& axis, const Vec3& center_mm, double angle_degrees) {
  const double length = axis.stableNorm();
  if (!(length > 0)) base::refuse("the axis of a rotation must not be zero");
  const Vec3 u = (axis / length).normalized();
  const double angle = angle_degrees * (std::numbers::pi / 180);
  // t = (I − R) c = −(sin θ u×c + 2 sin²(θ/2) u×(u×c)): no digits lost for small angles.
  const Vec3 across = u.cross(center_mm);
  const double half = std::sin(0.5 * angle);
  const Vec3 translation = -(std::sin(angle) * across + 2 * half * half * u.cross(across));
  return {turn(u, angle), translation};
}

RigidMotion RigidMotion::after(const RigidMotion& first) const {
  return {rotation_ * first.rotation_, rotation_ * first.translation_ + translation_};
}

RigidMotion RigidMotion::inverse() const {
  return {rotation_.transpose(), -(rotation_.transpose() * translation_)};
}

Mat4 RigidMotion::matrix(double load) const {
  Mat4 result = Mat4::Identity();
  if (load == 0) return result;
  result.topLeftCorner<3, 3>() = rotation_;
  result.topRightCorner<3, 1>() = translation_;
  if (load == 1) return result;
  const auto [axis, angle] = axis_angle(rotation_);
  const double part = angle > 0 ? std::sin(0.5 * load * angle) / std::sin(0.5 * angle) : load;
  const Vec3 along = axis.dot(translation_) * axis, across = translation_ - along;
  result.topLeftCorner<3, 3>() = turn(axis, load * angle);
  result.topRightCorner<3, 1>() =
      load * along + part * (turn(axis, 0.5 * (load - 1) * angle) * across);
  return result;
}

Vec3 RigidMotion::apply(const Vec3& point, double load) const {
  const Mat4 m = matrix(load);
  return m.topLeftCorner<3, 3>() * point + m.topRightCorner<3, 1>();
}

bool RigidMotion::is_identity() const {
  return (rotation_ - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-12 &&
         translation_.stableNorm() <= 1e-9;
}

bool determines_rotation(const std::vector<Vec3>& points) { return base::breadth(points) > 1e-6; }

RigidFit fit_rigid_motion(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  if (from.size() != to.size())
    base::refuse("a rigid fit needs as many points as targets; there are {} and {}", from.size(),
                 to.size());
  if (!determines_rotation(from))
    base::refuse("a rigid fit needs at least three points that are not on a line; there are {}",
                 from.size());
  return with_residual(RigidMotion::from_matrix(base::fit_similarity(from, to, false).matrix()),
                       from, to);
}

RigidFit fit_landmarks(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  if (from.size() != to.size() || from.empty())
    throw base::InternalError("landmarks to fit are not in pairs");
  if (from.size() > 2) return fit_rigid_motion(from, to);
  const bool one = from.size() == 1;
  return with_residual(one ? RigidMotion::translation(to[0] - from[0]) : line_up(from, to), from,
                       to);
}

}  // namespace repose::scene
