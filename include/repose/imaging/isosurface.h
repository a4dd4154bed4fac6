#pragma once
#include "repose/imaging/volume.h"
#include "repose/surface/surface.h"

namespace repose::imaging {

using surface::Surface;

/// Treatment of a surface at the border of the volume.
enum class VolumeBorder {
  closed,  ///< capped in the outermost voxel centers: the result is closed
  open     ///< cut off: the result has a rim there
};

/// The surface where the trilinear samples cross `level`, by marching cubes: vertices on grid edges
/// by linear interpolation (kept 0.1 % of the edge away from its ends, so that no triangle is
/// flat), triangles counter-clockwise seen from where values are below the level. On a face whose
/// corners alternate, corners at or above the level are always parted, from either side, and no
/// triangle has a diagonal within a face of a cube: so the result is manifold, and closed but for
/// an open border, by construction (see cube_cases.h). Voxels of beyond_volume are outside the
/// border. Nothing is welded. Throws InputError, naming the range, where no value or every value is
/// at or above the level. O(voxels); memory beside the result: three slices.
Surface isosurface(const Volume& volume, double level, VolumeBorder border = VolumeBorder::closed,
                   const Watch& watch = {});

}  // namespace repose::imaging
