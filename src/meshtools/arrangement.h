#pragma once
#include <array>
#include <vector>

#include "repose/surface/surface.h"

namespace repose::meshtools {

using surface::Surface;

/// A closed surface and sheets that cross it and each other, cut along their common lines: all
/// triangles on shared points, and the cells of space that they part.
struct Arrangement {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<int32_t> origin;                ///< [T] −1: of the bone, else row of its sheet
  std::vector<std::array<int64_t, 2>> cells;  ///< [T] the cell in front of each (the side its
                                              ///< normal points to) and the one behind
};

/// Computed exactly (CGAL corefinement; Edelsbrunner's cells around each edge by their angular
/// order), then points are rounded. Cells that only touch in an edge are two. Shells that no sheet
/// meets bound cells of their own; sheets that do not meet the bone are left out. Throws InputError
/// where a sheet runs along a triangle of another surface, or surfaces intersect themselves there.
Arrangement arrange(const Surface& bone, const std::vector<Surface>& sheets);

}  // namespace repose::meshtools
