#pragma once
#include "repose/mechanics/term.h"

namespace repose::mechanics {

/// Elastic support of a point of tissue by a bone: a spring of no rest length between the point and
/// its initial place on the bone (docs/theory/load_path.md). Numbers: the place, mm; the stiffness,
/// N/mm; the row of the bone.
struct ElasticSupport {
  static constexpr int points = 1, numbers = 5;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    return n[3] / 2 * (x[0] - Vec3(n[0], n[1], n[2]).cast<Number>()).squaredNorm();
  }
};

}  // namespace repose::mechanics
