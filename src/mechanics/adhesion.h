#pragma once
#include "repose/mechanics/term.h"

namespace repose::mechanics {

/// Adhesion of a point of tissue to a plane of a bone: a cohesive law with a largest tension,
/// beyond which the film opens (docs/theory/contact.md). Points: the tissue's and three of the
/// bone, which carry the plane. Numbers: the plane's unit normal in the frame e1 = x2 − x1, e2 = x3
/// − x1, e1 × e2, its distance from x1 at which the film begins to open, mm; the largest tension
/// times the area, N; the opening beyond which there is none, mm.
struct Adhesion {
  static constexpr int points = 4, numbers = 6;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    using Vector = Eigen::Matrix<Number, 3, 1>;
    const Vector first = x[2] - x[1], second = x[3] - x[1];
    const Vector normal =
        first * Number(n[0]) + second * Number(n[1]) + first.cross(second) * Number(n[2]);
    const Number s = (normal.dot(x[0] - x[1]) - n[3]) / n[5];
    const double scale = 6.75 * n[4] * n[5];  // the tension is 6.75 s (1 − s)² of the largest
    if (!(s > 0.0)) return 0.0 * s;
    if (!(s < 1.0)) return 0.0 * s + scale / 12;
    return scale * s * s * (0.5 + s * (-2.0 / 3 + 0.25 * s));
  }
};

}  // namespace repose::mechanics
