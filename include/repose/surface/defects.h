#pragma once
#include <cstdint>
#include <string>

#include "repose/surface/surface.h"

namespace repose::surface {

/// Counts of the defects of a surface. All counts are exact.
struct Defects {
  int64_t border_loops = 0;  ///< holes, or the rim of an open patch, taken from fan to fan
  int64_t border_edges = 0;
  int64_t non_manifold_edges = 0;     ///< edges with more than two triangles
  int64_t non_manifold_vertices = 0;  ///< vertices whose triangles do not form one fan (the ends of
                                      ///< a non-manifold edge among them)
  int64_t misoriented_edges = 0;      ///< interior edges whose two triangles disagree
  int64_t self_intersections = 0;     ///< pairs of triangles that meet outside what they share
                                      ///< (the test of CGAL does_self_intersect)
  int64_t components = 0;             ///< connected by edges
  int64_t duplicate_vertices = 0;     ///< vertices that coincide with an earlier one (≤ 1e-9
                                      ///< of the bounding diagonal away)
  int64_t isolated_vertices = 0;      ///< vertices in no triangle
  int64_t degenerate_triangles = 0;   ///< zero area or a repeated vertex
  int64_t first_non_manifold_edge[2] = {-1, -1};  ///< its vertices, −1 for none
  int64_t first_non_manifold_vertex = -1;         ///< −1 for none
  bool outward = false;                           ///< closed and bounding a positive volume
};

/// Inspects a surface as it stands. Triangles that name a vertex twice take no part in the counts
/// of edges, loops and components; triangles without area none in self-intersections, for which
/// vertices that coincide are one. Throws InputError naming the surface for a coordinate that is
/// not finite or an index without a point. Self-intersections are searched for when
/// `self_intersections` is true (the slow part, O(T log T)).
Defects inspect(const Surface& surface, bool self_intersections = true);

/// One line for a person: "closed, 1 component, no defect" or the defects with their numbers.
std::string describe(const Defects& defects);

}  // namespace repose::surface
