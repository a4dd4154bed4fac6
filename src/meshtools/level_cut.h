#pragma once
#include "repose/surface/surface.h"

namespace repose::meshtools {

using surface::Surface;

/// Returns the part of a closed manifold surface with values ≥ 0, linear in its triangles: cut
/// exactly along 0.
Surface cut_at_zero(const Surface& surface, const std::vector<double>& values);

}  // namespace repose::meshtools
