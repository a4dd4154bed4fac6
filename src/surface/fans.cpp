#include "repose/surface/edges.h"

#include <map>

namespace repose::surface {

UnionFind fans(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  UnionFind corners(3 * static_cast<int64_t>(triangles.size()));
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const auto edge = edges[e];
    if (edge.size() != 2) continue;
    corners.unite(edge[0].corner_at_low(), edge[1].corner_at_low());
    corners.unite(edge[0].corner_at_high(), edge[1].corner_at_high());
  }
  return corners;
}

void split_fans(Surface& surface) {
  UnionFind corners = fans(surface.triangles, EdgeTable(surface.triangles));
  std::vector<int64_t> keeper(surface.points.size(), -1);
  std::map<int64_t, int64_t> copy;  // of a fan's point
  for (int64_t c = 0; c < 3 * static_cast<int64_t>(surface.triangles.size()); ++c) {
    int64_t& vertex = surface.triangles[c / 3][c % 3];
    const int64_t fan = corners.find(c);
    if (keeper[vertex] < 0) keeper[vertex] = fan;
    if (keeper[vertex] == fan) continue;
    const auto next = static_cast<int64_t>(surface.points.size());
    const auto [place, fresh] = copy.try_emplace(fan, next);
    const Vec3 point = surface.points[vertex];
    if (fresh) surface.points.push_back(point);
    vertex = place->second;
  }
}

}  // namespace repose::surface
