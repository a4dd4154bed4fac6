#pragma once
#include <Eigen/Cholesky>

#include "repose/surface/triangle_tree.h"

namespace repose::tools::decimation {

using surface::Corners;

/// A sum of squared distances to planes weighted by area, xᵀA x + 2 bᵀx + c (Garland and Heckbert,
/// Surface simplification using quadric error metrics, 1997), mm⁴. Positions count from an origin
/// near the surface, to keep digits.
struct Quadric {
  Mat3 a = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  double c = 0;

  /// The plane of a triangle, times its area.
  static Quadric of(const Corners& t) {
    const Vec3 normal = surface::scaled_normal(t);
    const double twice_area = normal.norm();
    if (!(twice_area > 0)) return {};
    const Vec3 n = normal / twice_area;
    const double d = -n.dot(t[0]), area = 0.5 * twice_area;
    return {area * n * n.transpose(), area * d * n, area * d * d};
  }

  Quadric operator+(const Quadric& other) const { return {a + other.a, b + other.b, c + other.c}; }

  double at(const Vec3& x) const { return x.dot(a * x) + 2 * b.dot(x) + c; }

  /// The minimizer; where the planes leave it open, it stays near `start` (Tikhonov, as if each
  /// plane were uncertain: Trettner and Kobbelt, Fast and robust QEF minimization, 2020).
  Vec3 minimizer(const Vec3& start) const {
    const double scale = a.trace();
    if (!(scale > 0)) return start;
    const Mat3 damped = a + 1e-3 * scale * Mat3::Identity();
    return start - damped.ldlt().solve(a * start + b);
  }
};

}  // namespace repose::tools::decimation
