#pragma once
#include "repose/surface/surface.h"

namespace repose::meshtools {

using surface::Surface;

/// Edge length of as many equilateral triangles of the same total area, mm: what remesh would need
/// to keep the number of triangles.
double even_edge(const Surface& surface);

/// The surface with nearly equilateral triangles whose edges are about `edge` mm long, its border
/// loops kept as curves: isotropic remeshing (Botsch & Kobbelt 2004; CGAL). The surface is manifold
/// (load_surface, Role::skin). Throws InputError where nothing of that size is left of it.
Surface remesh(const Surface& surface, double edge);

}  // namespace repose::meshtools
