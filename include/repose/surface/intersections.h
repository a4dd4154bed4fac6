#pragma once
#include <utility>
#include <vector>

#include "repose/surface/triangle_tree.h"

/// Exact questions about triangles.
namespace repose::surface {

/// Returns whether two triangles with area meet anywhere but in a vertex or an edge that they share
/// by number (true where they share all three).
bool meet(const Triangle& a, const Corners& a_corners, const Triangle& b, const Corners& b_corners);

/// For each triangle whether it has no area: its corners lie on one line or coincide (exact).
std::vector<bool> without_area(const Surface& surface);

/// All pairs of triangles that meet anywhere but in a vertex or an edge they share by number, the
/// lower triangle first, sorted. Triangles without area are left out. The test is that of CGAL's
/// does_self_intersect (Botsch et al.; exact predicates), but needs no manifold.
/// O(T log T + pairs).
std::vector<std::pair<int64_t, int64_t>> self_intersections(const Surface& surface);

/// Pairs of triangles that meet in `now` and did not in `before`, which has the same triangles;
/// order and exactness as self_intersections().
std::vector<std::pair<int64_t, int64_t>> new_intersections(const Surface& before,
                                                           const Surface& now);

}  // namespace repose::surface
