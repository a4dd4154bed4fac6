#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "repose/base/geometry.h"

namespace repose::model {

/// Signed volume (mm³) of a prism with triangles p[0] p[1] p[2] = a and p[3] p[4] p[5] = b and
/// bilinear lateral faces: the exact volume under the trilinear wedge map, whatever the diagonals.
///
///     v = D · [ 2 A1×A2 + (A1×B2 + B1×A2) + 2 B1×B2 ] / 12
///     A1 = a1−a0, A2 = a2−a0, B1 = b1−b0, B2 = b2−b0, D = ⅓ Σ (b_i − a_i)
///
/// Positive when (a1−a0)×(a2−a0) points from a towards b. S is any scalar Eigen accepts (double,
/// an automatic-differentiation type).
template <class S>
S prism_volume(const Eigen::Matrix<S, 3, 1> p[6]) {
  using Vector = Eigen::Matrix<S, 3, 1>;
  const Vector a1 = p[1] - p[0], a2 = p[2] - p[0];
  const Vector b1 = p[4] - p[3], b2 = p[5] - p[3];
  const Vector sum = (p[3] - p[0]) + (p[4] - p[1]) + (p[5] - p[2]);
  const Vector normals = S(2) * a1.cross(a2) + a1.cross(b2) + b1.cross(a2) + S(2) * b1.cross(b2);
  return sum.dot(normals) / S(36);
}

}  // namespace repose::model
