#pragma once
#include "repose/surface/surface.h"

namespace repose::imaging {

using surface::Surface;

/// Options of the skin that a ball rolled over the outside of a surface, and another over its
/// inside, touch.
struct Rolling {
  double voxel = 1.5;    ///< mm of the grid on which it is done
  double outside = 3.0;  ///< mm, radius: closes holes, slits and nostrils up to twice as wide
  double inside = 8.0;   ///< mm, radius: takes off what is thinner than twice this, such as ears
  double sampling = 0;   ///< mm between the samples that the skin is made of, if above a voxel
};

/// The outer skin of any triangles: open, flipped, doubled or with inner walls.
struct OuterSkin {
  Surface skin;  ///< closed, manifold, one component; smooth to about a voxel
  Surface caps;  ///< flat ends of the scan (as parts of the skin, cap_height mm outside of them)
  double cap_height;
  Surface openings;  ///< cones over border loops as long as that of an open mouth
};

/// Distances d to the given triangles on a grid; the outside is what a ball reaches from beyond the
/// surface, {d ≥ outside} where it is connected, and the solid what stays farther than that from
/// its centers; the solid is then opened by the inside ball (erosion, then dilation). Each border
/// is an isosurface of an unrounded distance, so balls rest on triangles and not on voxels. A
/// border loop so long that the head is open there is closed by a cone first, which counts as a
/// cap, as do flat parts larger than `cap_area`. Throws InputError where nothing as thick as the
/// inside ball is left.
OuterSkin outer_skin(const Surface& given, const Rolling& rolling);

}  // namespace repose::imaging
