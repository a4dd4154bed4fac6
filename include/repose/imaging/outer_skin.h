#pragma once
#include "repose/surface/surface.h"

namespace repose::imaging {

using surface::Surface;

/// Radii, mm, of the ball that is rolled over the outside of a surface, which closes holes, slits
/// and nostrils up to twice as wide, and of the one over its inside, which takes off what is
/// thinner than twice this, such as ears.
constexpr double outside_ball = 3, inside_ball = 8;

/// The outer skin of any triangles: open, flipped, doubled or with inner walls.
struct OuterSkin {
  Surface skin;      ///< closed, manifold, one component; smooth to about a voxel
  Surface caps;      ///< flat ends of the scan: parts of the skin, outside_ball mm outside of them
  Surface openings;  ///< cones over border loops as long as that of an open mouth
};

/// Distances d to the given triangles on a grid; the outside is what a ball reaches from beyond the
/// surface, {d ≥ outside} where it is connected, and the solid what stays farther than that from
/// its centers; the solid is then opened by the inside ball (erosion, then dilation). Each border
/// is an isosurface of an unrounded distance, so balls rest on triangles and not on voxels. A
/// border loop so long that the head is open there is closed by a cone first, which counts as a
/// cap, as do large flat parts. `sampling`: mm between the samples that the skin is made of, if
/// above a voxel of the grid, 1.5 mm. Throws InputError where nothing as thick as the inside ball
/// is left.
OuterSkin outer_skin(const Surface& given, double sampling);

}  // namespace repose::imaging
