#pragma once
#include <algorithm>

#include "repose/scene/rigid_motion.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// mm: bone that moves by less counts as bone at rest where the border of the skin and the region
/// that is solved are chosen.
constexpr double negligible_travel = 0.1;

/// Distance (mm) by which a motion displaces a point.
inline double travel(const Vec3& point, const scene::RigidMotion& move) {
  return (move.apply(point) - point).norm();
}

/// Largest distance (mm) by which a motion displaces a point of a surface.
inline double travel(const surface::Surface& body, const scene::RigidMotion& move) {
  double largest = 0;
  for (const Vec3& x : body.points) largest = std::max(largest, travel(x, move));
  return largest;
}

}  // namespace repose::model
