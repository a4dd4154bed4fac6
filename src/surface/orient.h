#pragma once
#include "repose/surface/surface.h"

namespace repose::surface {

/// Turns triangles so that neighbors agree. Each part connected over edges of two triangles is
/// turned as a whole: a closed one outwards (inwards where it is the wall of a cavity, inside an
/// odd number of other closed parts), an open one as the majority of its triangles was.
void orient(Surface& surface);

}  // namespace repose::surface
