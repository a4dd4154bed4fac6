#pragma once
#include "repose/imaging/volume.h"
#include "repose/surface/surface.h"

namespace repose::imaging {

using surface::Surface;

/// A grid of cubes of `voxel` mm whose values are the distance, mm, from each center to the nearest
/// triangle, whatever the triangles' orientation and holes; `reach` mm where it is larger. It
/// reaches at least `margin` mm beyond the surface on every side. Exact in the voxels that a
/// triangle passes; elsewhere the closest points are handed on from voxel to voxel (Danielsson,
/// "Euclidean distance mapping", 1980), which is wrong by a small part of a voxel at most. O(voxels
/// + T).
Volume distance_volume(const Surface& surface, double voxel, double margin, double reach);

/// Distances in the voxels of a grid whose values are positive, 0 in the others.
Volume distance_volume(const Surface& surface, Volume grid, double reach);

}  // namespace repose::imaging
