#pragma once
#include <utility>
#include <vector>

#include "repose/surface/surface.h"

/// Exact questions about triangles.
namespace repose::surface {

/// For each triangle whether it has no area: its corners lie on one line or coincide (exact).
std::vector<bool> without_area(const Surface& surface);

/// All pairs of triangles that meet anywhere but in a vertex or an edge they share by number, the
/// lower triangle first, sorted. Triangles without area are left out. The test is that of CGAL's
/// does_self_intersect (Botsch et al.; exact predicates), but asks for no manifold.
/// O(T log T + pairs).
std::vector<std::pair<int64_t, int64_t>> self_intersections(const Surface& surface);

}  // namespace repose::surface
