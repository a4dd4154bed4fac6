#pragma once
#include <cmath>

#include "repose/mechanics/term.h"

namespace repose::mechanics {

/// Adhesion of a point of tissue to a plane of a bone: a tension that grows with the way off the
/// plane towards a largest one and never falls, so that the energy is convex in the tissue's
/// positions (docs/theory/contact.md). Points: the tissue's and three of the bone, which carry the
/// plane. Numbers: the plane's unit normal in the frame e1 = x2 − x1, e2 = x3 − x1, e1 × e2, its
/// distance from x1 at which the tension begins, mm; the largest tension times the area, N; the way
/// at which 1/√2 of it is reached, mm.
struct Adhesion {
  static constexpr int points = 4, numbers = 6;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    using std::sqrt;
    using Vector = Eigen::Matrix<Number, 3, 1>;
    const Vector first = x[2] - x[1], second = x[3] - x[1];
    const Vector normal =
        first * Number(n[0]) + second * Number(n[1]) + first.cross(second) * Number(n[2]);
    const Number s = (normal.dot(x[0] - x[1]) - n[3]) / n[5];
    if (!(s > 0.0)) return 0.0 * s;
    const Number square = s * s;
    const Number root = sqrt(Number(1.0 + square));
    return n[4] * n[5] * square / (1.0 + root);  // √(1 + s²) − 1
  }
};

}  // namespace repose::mechanics
