#include "repose/surface/defects.h"

#include <fmt/format.h>

#include <algorithm>

#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"
#include "repose/surface/read.h"

namespace repose::surface {
namespace {

void count_vertex_defects(const Surface& surface, const std::vector<int64_t>& first, Defects& d) {
  std::vector<bool> used(surface.points.size(), false);
  for (const auto& triangle : surface.triangles)
    for (const int64_t vertex : triangle) used[vertex] = true;
  d.isolated_vertices = std::count(used.begin(), used.end(), false);
  for (size_t i = 0; i < first.size(); ++i)
    if (first[i] != static_cast<int64_t>(i)) ++d.duplicate_vertices;
}

void count_edge_defects(const EdgeTable& edges, Defects& d) {
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const auto edge = edges[e];
    if (edge.size() == 1) ++d.border_edges;
    if (edge.size() == 2 && edge[0].rising == edge[1].rising) ++d.misoriented_edges;
    if (edge.size() <= 2) continue;
    if (++d.non_manifold_edges > 1) continue;
    d.first_non_manifold_edge[0] = edge[0].low;
    d.first_non_manifold_edge[1] = edge[0].high;
  }
}

void count_fans(const Surface& surface, UnionFind& corners, Defects& d) {
  std::vector<int> fans_at(surface.points.size(), 0);
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    if (repeats_vertex(surface.triangles[t])) continue;
    for (int k = 0; k < 3; ++k) {
      const int64_t corner = 3 * static_cast<int64_t>(t) + k;
      if (corners.find(corner) == corner) ++fans_at[surface.triangles[t][k]];
    }
  }
  const auto several = [](int fans) { return fans > 1; };
  d.non_manifold_vertices = std::count_if(fans_at.begin(), fans_at.end(), several);
  if (d.non_manifold_vertices > 0)
    d.first_non_manifold_vertex =
        std::find_if(fans_at.begin(), fans_at.end(), several) - fans_at.begin();
}

/// A border continues from edge to edge where both belong to one fan, as if each fan had a vertex
/// of its own.
int64_t count_border_loops(const EdgeTable& edges, UnionFind& corners, size_t triangles) {
  std::vector<int64_t> edge_at_fan(3 * triangles, -1);
  const std::vector<HalfEdge> border = edges.border();
  const std::vector<int64_t> rows = base::all_rows(border.size());
  UnionFind loops(std::ssize(border));
  for (const int64_t e : rows)
    for (const int64_t corner : {border[e].corner_at_low(), border[e].corner_at_high()}) {
      int64_t& other = edge_at_fan[corners.find(corner)];
      if (other >= 0) loops.unite(e, other);
      other = e;
    }
  return std::ranges::count_if(rows, [&](int64_t e) { return loops.find(e) == e; });
}

/// Vertices that coincide count as one here, or every seam would be a crossing.
int64_t count_self_intersections(const Surface& surface) {
  return std::ssize(self_intersections(welded(surface)));
}

}  // namespace

Defects inspect(const Surface& surface, bool self_intersections) {
  require_sound(surface);
  Defects d;
  const auto first = coincident_points(surface.points);
  count_vertex_defects(surface, first, d);
  const auto flat = without_area(surface);
  d.degenerate_triangles = std::count(flat.begin(), flat.end(), true);
  const EdgeTable edges(surface.triangles);
  count_edge_defects(edges, d);
  d.components = static_cast<int64_t>(component_sizes(surface.triangles, edges).size());
  UnionFind corners = fans(surface.triangles, edges);
  count_fans(surface, corners, d);
  d.border_loops = count_border_loops(edges, corners, surface.triangles.size());
  if (self_intersections) d.self_intersections = count_self_intersections(surface);
  const bool closed = d.border_edges == 0 && d.non_manifold_edges == 0;
  d.outward =
      closed && d.misoriented_edges == 0 && six_volumes(surface.points, surface.triangles) > 0;
  return d;
}

std::string describe(const Defects& d) {
  std::string text;
  const auto add = [&](int64_t count, const char* one, const char* many) {
    if (count > 0) text += fmt::format(", {} {}", count, count == 1 ? one : many);
  };
  add(d.border_loops, "border loop", "border loops");
  add(d.border_edges, "border edge", "border edges");
  add(d.components, "component", "components");
  const size_t shape = text.size();
  add(d.non_manifold_edges, "non-manifold edge", "non-manifold edges");
  add(d.non_manifold_vertices, "non-manifold vertex", "non-manifold vertices");
  add(d.misoriented_edges, "misoriented edge", "misoriented edges");
  add(d.self_intersections, "self-intersection", "self-intersections");
  add(d.duplicate_vertices, "duplicate vertex", "duplicate vertices");
  add(d.isolated_vertices, "isolated vertex", "isolated vertices");
  add(d.degenerate_triangles, "degenerate triangle", "degenerate triangles");
  const bool closed = d.border_edges == 0 && d.non_manifold_edges == 0 && d.components > 0;
  if (closed && d.misoriented_edges == 0 && !d.outward) text += ", turned inside out or flat";
  if (text.size() == shape) text += ", no defect";
  if (d.components == 0) return "no triangles" + text;
  return (d.border_edges > 0 ? "open" : "closed") + text;
}

}  // namespace repose::surface
