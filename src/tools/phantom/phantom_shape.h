#pragma once
#include "repose/base/geometry.h"

/// The shape of the synthetic head, before any mesh, as signed distances (mm, negative inside).
/// Axes LPS: +x patient left, +y posterior (the face looks to −y), +z up; the jaw's hinge axis is
/// the x axis and the head is symmetric in x.
namespace repose::tools::phantom {

/// The three solids. The skull keeps 2.5 mm away from the mandible, and the skin 5 mm outside both
/// bones, by construction: the distance of one enters the other.
double mandible_distance(const Vec3& point);
double skull_distance(const Vec3& point);
double skin_distance(const Vec3& point);

}  // namespace repose::tools::phantom
