#include "repose/model/skin_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "repose/base/error.h"
#include "repose/surface/edges.h"

namespace repose::model {
namespace {

void refuse_bad_edge(const surface::Surface& skin, std::span<const surface::HalfEdge> edge) {
  const surface::HalfEdge& side = edge.front();
  base::refuse("{}: the edge between vertices {} and {} near {:.2f} {}; repair the skin mesh there",
               skin.name, side.low, side.high, skin.points[side.low],
               edge.size() > 2
                   ? fmt::format("has {} triangles, at most 2 are possible", edge.size())
                   : std::string("has two triangles that face opposite ways"));
}

void collect_edges(SkinMesh& mesh, const surface::Surface& skin) {
  const surface::EdgeTable edges(mesh.triangles);
  std::vector<int> found(mesh.triangles.size(), 0);
  mesh.triangle_edges.resize(mesh.triangles.size());
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const auto edge = edges[e];
    if (edge.size() > 2 || (edge.size() == 2 && edge[0].rising == edge[1].rising))
      refuse_bad_edge(skin, edge);
    double area = 0;
    for (const auto& [low, high, f, corner, rising] : edge) {
      area += mesh.triangle_normal[f].norm();
      mesh.triangle_edges[f][found[f]++] = e;
    }
    mesh.edges.push_back({edge[0].low, edge[0].high});
    mesh.edge_triangles.push_back(static_cast<int32_t>(edge.size()));
    mesh.edge_area.push_back(area);
  }
}

void measure_triangles(SkinMesh& mesh, const surface::Surface& skin) {
  const auto vertices = static_cast<int64_t>(mesh.points.size());
  mesh.vertex_area.assign(vertices, 0);
  mesh.vertex_normal.assign(vertices, Vec3::Zero());
  for (size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    for (const int64_t v : t)
      if (v < 0 || v >= vertices)
        base::refuse("{}: triangle {} names vertex {}, but there are {} vertices", skin.name, f, v,
                     vertices);
    const Vec3 u = mesh.points[t[2]] - mesh.points[t[0]], v = mesh.points[t[1]] - mesh.points[t[0]];
    const Vec3 normal = 0.5 * u.cross(v);
    if (!(normal.norm() > 1e-12 * std::max(u.squaredNorm(), v.squaredNorm())))
      base::refuse("{}: triangle {} (vertices {}, {}, {}) has no area; repair the skin mesh there",
                   skin.name, f, t[0], t[1], t[2]);
    mesh.triangle_normal.push_back(normal);
    for (const int64_t v_in : t) {
      mesh.vertex_area[v_in] += normal.norm() / 3;
      mesh.vertex_normal[v_in] += normal;
    }
  }
  for (Vec3& n : mesh.vertex_normal) n.normalize();
}

/// Returns the rows that name each vertex; `lists` holds the vertices of each triangle or edge.
template <class Lists>
Rows invert(const Lists& lists, int64_t vertices) {
  Rows rows;
  rows.begin.assign(vertices + 1, 0);
  for (const auto& list : lists)
    for (const int64_t v : list) ++rows.begin[v + 1];
  std::partial_sum(rows.begin.begin(), rows.begin.end(), rows.begin.begin());
  rows.item.resize(rows.begin.back());
  std::vector<int64_t> next(rows.begin.begin(), rows.begin.end() - 1);
  for (size_t i = 0; i < lists.size(); ++i)
    for (const int64_t v : lists[i]) rows.item[next[v]++] = static_cast<int64_t>(i);
  return rows;
}

/// Walks the border from `edge` until no unused border edge is left at the walk's end.
std::vector<int64_t> walk_border(const SkinMesh& mesh, int64_t edge, std::vector<char>& used) {
  std::vector<int64_t> loop = {mesh.edges[edge][0]};
  int64_t at = mesh.edges[edge][1];
  used[edge] = 1;
  while (at != loop.front()) {
    loop.push_back(at);
    const auto around = mesh.edges_of[at];
    const auto next = std::find_if(around.begin(), around.end(), [&](int64_t e) {
      return mesh.edge_triangles[e] == 1 && !used[e];
    });
    if (next == around.end()) break;
    used[*next] = 1;
    at = mesh.other_end(*next, at);
  }
  return loop;
}

double loop_length(const SkinMesh& mesh, const std::vector<int64_t>& loop) {
  double length = 0;
  for (size_t i = 0; i < loop.size(); ++i)
    length += (mesh.points[loop[(i + 1) % loop.size()]] - mesh.points[loop[i]]).norm();
  return length;
}

void collect_border_loops(SkinMesh& mesh) {
  std::vector<char> used(mesh.edges.size(), 0);
  for (size_t e = 0; e < mesh.edges.size(); ++e)
    if (mesh.edge_triangles[e] == 1 && !used[e])
      mesh.border_loops.push_back(walk_border(mesh, static_cast<int64_t>(e), used));
  std::stable_sort(
      mesh.border_loops.begin(), mesh.border_loops.end(),
      [&](const auto& a, const auto& b) { return loop_length(mesh, a) > loop_length(mesh, b); });
}

}  // namespace

SkinMesh make_skin_mesh(const surface::Surface& skin) {
  SkinMesh mesh;
  mesh.points = skin.points;
  mesh.triangles = skin.triangles;
  measure_triangles(mesh, skin);
  collect_edges(mesh, skin);
  const auto vertices = static_cast<int64_t>(mesh.points.size());
  mesh.triangles_of = invert(mesh.triangles, vertices);
  mesh.edges_of = invert(mesh.edges, vertices);
  for (int64_t v = 0; v < vertices; ++v)
    if (mesh.triangles_of[v].empty())
      base::refuse("{}: vertex {} is in no triangle; remove it from the skin mesh", skin.name, v);
  collect_border_loops(mesh);
  return mesh;
}

std::vector<int64_t> triangles_at(const SkinMesh& mesh, const std::vector<int64_t>& vertices) {
  std::vector<int64_t> triangles;
  for (const int64_t v : vertices) {
    const auto around = mesh.triangles_of[v];
    triangles.insert(triangles.end(), around.begin(), around.end());
  }
  base::sort_unique(triangles);
  return triangles;
}

std::vector<int64_t> vertices_of(const SkinMesh& mesh, const std::vector<int64_t>& triangles) {
  std::vector<int64_t> vertices;
  for (const int64_t t : triangles)
    vertices.insert(vertices.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  base::sort_unique(vertices);
  return vertices;
}

void flip(SkinMesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Vec3& n : mesh.triangle_normal) n = -n;
  for (Vec3& n : mesh.vertex_normal) n = -n;
}

}  // namespace repose::model
