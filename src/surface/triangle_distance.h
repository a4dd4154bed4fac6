#pragma once
#include "repose/surface/triangle_tree.h"

namespace repose::surface {

/// The shortest way between two triangles.
struct ShortestSegment {
  double squared;  ///< mm², 0 where they intersect
  Vec3 middle;     ///< mm, its middle
};

/// From the nine pairs of sides, the six of a corner and the other triangle, and the crossings of a
/// side and the other triangle (Ericson, Real-Time Collision Detection, 2005, ch. 5). Where
/// rounding hides a crossing, a side or a corner is within rounding of the other triangle.
ShortestSegment shortest_segment(const Corners& a, const Corners& b);

}  // namespace repose::surface
