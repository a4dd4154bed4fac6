#pragma once
#include <cmath>

#include "repose/mechanics/term.h"

namespace repose::mechanics {

/// Adhesion of a point of tissue to a plane of a bone: a tension that grows with the way off the
/// plane towards a largest one and never falls, so that the energy is convex in the tissue's
/// positions (docs/theory/contact.md). Numbers: the plane's unit normal and its place along it, mm;
/// the largest tension times the area, N; the way at which 1/√2 of it is reached, mm; the row of
/// the bone.
struct Adhesion {
  static constexpr int points = 1, numbers = 7;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    using std::sqrt;
    const Number s = (x[0].dot(Vec3(n[0], n[1], n[2]).cast<Number>()) - n[3]) / n[5];
    if (!(s > 0.0)) return 0.0 * s;
    const Number square = s * s;
    const Number root = sqrt(Number(1.0 + square));
    return n[4] * n[5] * square / (1.0 + root);  // √(1 + s²) − 1
  }
};

}  // namespace repose::mechanics
