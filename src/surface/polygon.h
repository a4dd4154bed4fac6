#pragma once
#include <vector>

#include "repose/surface/surface.h"

namespace repose::surface {

/// Cuts a simple polygon into corners − 2 triangles of the same sense by clipping ears; the polygon
/// need be neither convex nor flat (its projection along its mean normal decides). A polygon that
/// crosses itself is cut all the same. O(corners²) for the usual ones.
void triangulate(const std::vector<Vec3>& points, std::vector<int64_t> polygon,
                 std::vector<Triangle>& triangles);

}  // namespace repose::surface
