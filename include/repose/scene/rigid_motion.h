#pragma once
#include <vector>

#include "repose/base/geometry.h"

namespace repose::scene {

/// A rigid motion x ↦ R x + t that can be made in part: at load s it turns by s times the angle
/// about the same axis through the same point and slides by s times the translation along it (a
/// screw motion, Chasles). With u the axis, θ in [0°, 180°] the angle and t = t∥ + t⊥ along and
/// across u,
///
///     R(s) = exp(sθ [u]×),   t(s) = s t∥ + sin(sθ/2)/sin(θ/2) · exp((s−1)θ/2 [u]×) t⊥
///
/// which needs no point on the axis and so holds for every angle, however small; for θ = 0 it is
/// t(s) = s t. The angle is that of R: a turn by 270° is made as one by −90°. A half turn goes the
/// way that makes the largest component of its axis positive.
class RigidMotion {
 public:
  RigidMotion() = default;  ///< identity
  /// From a homogeneous matrix; throws InputError if it is not rigid to 1e-6: every entry of RᵀR −
  /// I and of the last row, det R > 0, all finite. R becomes orthonormal to rounding (its polar
  /// factor); one that is already is kept bit for bit.
  static RigidMotion from_matrix(const Mat4& matrix);
  static RigidMotion translation(const Vec3& vector_mm);
  /// By the right-hand rule about `axis` (any length, throws InputError if zero) through `center`.
  static RigidMotion rotation(const Vec3& axis, const Vec3& center_mm, double angle_degrees);

  /// The motion that does `first`, then `*this`.
  RigidMotion after(const RigidMotion& first) const;
  RigidMotion inverse() const;
  /// The homogeneous matrix of the motion at load s in [0, 1] (0: identity, 1: R and t, both
  /// exactly).
  Mat4 matrix(double load = 1.0) const;
  Vec3 apply(const Vec3& point, double load = 1.0) const;
  /// R = I to 1e-12 and |t| ≤ 1e-9 mm.
  bool is_identity() const;

 private:
  RigidMotion(const Mat3& rotation, const Vec3& translation);

  Mat3 rotation_ = Mat3::Identity();
  Vec3 translation_ = Vec3::Zero();
};

/// The best rigid motion (Kabsch) taking `from` to `to`, and its largest residual in mm.
struct RigidFit {
  RigidMotion motion;
  double residual;  ///< mm
};
/// Least squares over all rotations (never a reflection). Both of the same length; `from` must
/// fix a rotation (below). Throws InputError otherwise.
RigidFit fit_rigid_motion(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

/// The motion that takes landmarks `from` to `to` (mm, equally many, at least one): one, the
/// translation; two, middle to middle and the least turn that lines them up; more, the best rigid
/// motion. Throws InputError where they do not fix a turn.
RigidFit fit_landmarks(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

/// Returns whether points determine a rotation: at least three, and not all within 1e-6 of their
/// extent of a line.
bool determines_rotation(const std::vector<Vec3>& points);

}  // namespace repose::scene
