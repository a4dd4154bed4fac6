#include <Eigen/Geometry>
#include <set>

#include "orient.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"

namespace repose::surface {
namespace {

void weld_points(Surface& surface) {
  const auto first = coincident_points(surface.points);
  for (auto& triangle : surface.triangles)
    for (auto& vertex : triangle) vertex = first[vertex];
  std::erase_if(surface.triangles, repeats_vertex);
}

/// Keeps the first of triangles with the same three vertices, in any order.
void drop_duplicates(std::vector<Triangle>& triangles) {
  std::set<Triangle> seen;
  std::erase_if(triangles, [&](Triangle triangle) {
    std::sort(triangle.begin(), triangle.end());
    return !seen.insert(triangle).second;
  });
}

/// A triangle without area has a vertex on its longest side: merely dropped, it would leave a slit.
/// Where one triangle lies beyond that side, the pair u v b, v u d becomes b u d, d v b. One pass,
/// each triangle at most once, orientation left to orient(); returns whether anything was flipped.
bool flip_flat_triangles(Surface& surface) {
  const auto flat = without_area(surface);
  const EdgeTable edges(surface.triangles);
  std::vector<bool> touched(surface.triangles.size(), false);
  std::set<std::pair<int64_t, int64_t>> made;
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const auto edge = edges[e];
    if (edge.size() != 2 || flat[edge[0].triangle] == flat[edge[1].triangle]) continue;
    const HalfEdge& side = flat[edge[0].triangle] ? edge[0] : edge[1];
    const HalfEdge& beyond = flat[edge[0].triangle] ? edge[1] : edge[0];
    Triangle &thin = surface.triangles[side.triangle], &wide = surface.triangles[beyond.triangle];
    if (touched[side.triangle] || touched[beyond.triangle]) continue;
    if (longest_edge(corners(surface, thin)) != side.corner) continue;
    const int64_t u = thin[side.corner], v = thin[(side.corner + 1) % 3];
    const int64_t b = thin[(side.corner + 2) % 3], d = wide[(beyond.corner + 2) % 3];
    if (b == d || edges.contains(b, d) || !made.insert(std::minmax(b, d)).second) continue;
    touched[side.triangle] = touched[beyond.triangle] = true;
    thin = {b, u, d};
    wide = {d, v, b};
  }
  return !made.empty();
}

/// Flips what can be flipped (a flip can leave another flat triangle to flip), drops the rest.
void remove_flat_triangles(Surface& surface) {
  constexpr int max_passes = 20;
  for (int pass = 0; pass < max_passes && flip_flat_triangles(surface);) ++pass;
  const auto flat = without_area(surface);
  size_t row = 0;
  std::erase_if(surface.triangles, [&](const Triangle&) { return flat[row++]; });
}

void drop_isolated_points(Surface& surface) {
  std::vector<int64_t> row(surface.points.size(), -1);
  for (const auto& triangle : surface.triangles)
    for (const int64_t vertex : triangle) row[vertex] = 0;
  std::vector<Vec3> kept;
  for (size_t i = 0; i < row.size(); ++i) {
    if (row[i] < 0) continue;
    row[i] = static_cast<int64_t>(kept.size());
    kept.push_back(surface.points[i]);
  }
  surface.points = std::move(kept);
  for (auto& triangle : surface.triangles)
    for (auto& vertex : triangle) vertex = row[vertex];
}

}  // namespace

Surface weld_and_orient(const Surface& raw) {
  require_sound(raw);
  Surface surface = raw;
  weld_points(surface);
  drop_duplicates(surface.triangles);
  remove_flat_triangles(surface);
  drop_isolated_points(surface);
  orient(surface);
  return surface;
}

}  // namespace repose::surface
