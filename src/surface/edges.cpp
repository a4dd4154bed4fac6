#include "repose/surface/edges.h"

#include <Eigen/Geometry>
#include <boost/container_hash/hash.hpp>
#include <functional>
#include <map>
#include <tuple>
#include <unordered_map>

#include "repose/base/error.h"

namespace repose::surface {
namespace {

using Cell = std::array<int64_t, 3>;

/// Points put into cubes four tolerances wide, so that few neighbors need a look.
class PointGrid {
 public:
  PointGrid(const std::vector<Vec3>& points, const Vec3& origin, double tolerance)
      : points_(points), origin_(origin), tolerance_(tolerance), next_(points.size(), -1) {}

  /// The earliest inserted point within the tolerance of `query`, −1 for none.
  int64_t find(const Vec3& query) const {
    const Vec3 reach = Vec3::Constant(tolerance_);
    const Cell from = cell(query - reach), to = cell(query + reach);
    int64_t found = -1;
    for (int64_t x = from[0]; x <= to[0]; ++x)
      for (int64_t y = from[1]; y <= to[1]; ++y)
        for (int64_t z = from[2]; z <= to[2]; ++z) search_cell({x, y, z}, query, found);
    return found;
  }

  void insert(int64_t i) {
    const auto [head, is_new] = heads_.try_emplace(cell(points_[i]), i);
    if (is_new) return;
    next_[i] = head->second;
    head->second = i;
  }

 private:
  Cell cell(const Vec3& point) const {
    const Vec3 scaled = ((point - origin_) / (4 * tolerance_)).array().floor();
    return {static_cast<int64_t>(scaled.x()), static_cast<int64_t>(scaled.y()),
            static_cast<int64_t>(scaled.z())};
  }

  void search_cell(const Cell& cell, const Vec3& query, int64_t& found) const {
    const auto head = heads_.find(cell);
    if (head == heads_.end()) return;
    for (int64_t i = head->second; i >= 0; i = next_[i])
      if ((points_[i] - query).norm() <= tolerance_ && (found < 0 || i < found)) found = i;
  }

  const std::vector<Vec3>& points_;
  Vec3 origin_;
  double tolerance_;
  std::unordered_map<Cell, int64_t, boost::hash<Cell>> heads_;
  std::vector<int64_t> next_;
};

}  // namespace

EdgeTable::EdgeTable(const std::vector<Triangle>& triangles) {
  std::vector<int64_t> next;  // [vertices + 1] where the half-edges of each lower vertex go
  const auto visit = [&](const auto& add) {
    for (size_t t = 0; t < triangles.size(); ++t) {
      if (repeats_vertex(triangles[t])) continue;
      for (int k = 0; k < 3; ++k) {
        const int64_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
        add(HalfEdge{std::min(a, b), std::max(a, b), static_cast<int64_t>(t), k, a < b});
      }
    }
  };
  for (const Triangle& t : triangles)
    next.resize(std::max<size_t>(next.size(), *std::ranges::max_element(t) + 2), 0);
  visit([&](const HalfEdge& half) { ++next[half.low + 1]; });
  std::partial_sum(next.begin(), next.end(), next.begin());
  half_edges_.resize(next.empty() ? 0 : next.back());
  visit([&](const HalfEdge& half) { half_edges_[next[half.low]++] = half; });
  for (size_t v = 0, first = 0; v < next.size(); first = next[v++])
    std::sort(half_edges_.begin() + first, half_edges_.begin() + next[v],
              [](const HalfEdge& a, const HalfEdge& b) {
                return std::tie(a.high, a.triangle) < std::tie(b.high, b.triangle);
              });
  for (size_t i = 0; i < half_edges_.size(); ++i)
    if (i == 0 || half_edges_[i].low != half_edges_[i - 1].low ||
        half_edges_[i].high != half_edges_[i - 1].high)
      begin_.push_back(i);
  begin_.push_back(half_edges_.size());
}

bool EdgeTable::contains(int64_t a, int64_t b) const {
  const std::pair requested(std::min(a, b), std::max(a, b));
  const auto found = std::lower_bound(
      half_edges_.begin(), half_edges_.end(), requested,
      [](const HalfEdge& h, const auto& pair) { return std::pair(h.low, h.high) < pair; });
  return found != half_edges_.end() && std::pair(found->low, found->high) == requested;
}

std::vector<HalfEdge> EdgeTable::border() const {
  std::vector<HalfEdge> border;
  for (int64_t e = 0; e < edges(); ++e)
    if ((*this)[e].size() == 1) border.push_back((*this)[e].front());
  return border;
}

VertexNeighbors::VertexNeighbors(const EdgeTable& edges, size_t vertices)
    : begin_(vertices + 1, 0), vertex_(2 * edges.edges()) {
  for (int64_t e = 0; e < edges.edges(); ++e) {
    ++begin_[edges[e].front().low + 1];
    ++begin_[edges[e].front().high + 1];
  }
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  std::vector<int64_t> next(begin_.begin(), begin_.end() - 1);
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const HalfEdge& half = edges[e].front();
    vertex_[next[half.low]++] = half.high;
    vertex_[next[half.high]++] = half.low;
  }
}

std::vector<char> border_vertices(const EdgeTable& edges, size_t points) {
  std::vector<char> border(points, 0);
  for (const HalfEdge& half : edges.border()) border[half.low] = border[half.high] = 1;
  return border;
}

UnionFind connected(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  UnionFind parts(std::ssize(triangles));
  for (int64_t e = 0; e < edges.edges(); ++e)
    for (const auto& half : edges[e]) parts.unite(edges[e].front().triangle, half.triangle);
  return parts;
}

std::vector<int64_t> component_sizes(const std::vector<Triangle>& triangles,
                                     const EdgeTable& edges) {
  UnionFind parts = connected(triangles, edges);
  std::vector<int64_t> sizes(triangles.size(), 0);
  for (size_t t = 0; t < triangles.size(); ++t)
    if (!repeats_vertex(triangles[t])) ++sizes[parts.find(static_cast<int64_t>(t))];
  std::erase(sizes, 0);
  std::sort(sizes.begin(), sizes.end(), std::greater<>());
  return sizes;
}

std::vector<int64_t> coincident_points(const std::vector<Vec3>& points) {
  std::vector<int64_t> first(points.size());
  if (points.empty()) return first;
  const double tolerance = std::max(1e-9 * bounding_diagonal(points), 1e-300);
  PointGrid grid(points, bounding_box(points).min(), tolerance);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto number = static_cast<int64_t>(i);
    const int64_t found = grid.find(points[i]);
    first[i] = found >= 0 ? found : number;
    if (found < 0) grid.insert(number);
  }
  return first;
}

Eigen::AlignedBox3d bounding_box(const std::vector<Vec3>& points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& point : points) box.extend(point);
  return box;
}

double bounding_diagonal(const std::vector<Vec3>& points) {
  return points.empty() ? 0 : bounding_box(points).diagonal().norm();
}

double six_volumes(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  double sum = 0;
  if (triangles.empty()) return sum;
  const Vec3& origin = points[triangles[0][0]];
  for (const auto& t : triangles)
    sum += (points[t[0]] - origin).dot((points[t[1]] - origin).cross(points[t[2]] - origin));
  return sum;
}

void require_sound(const Surface& surface) {
  for (size_t i = 0; i < surface.points.size(); ++i)
    if (!surface.points[i].allFinite())
      base::refuse("{}: vertex {} has a coordinate that is not finite; repair or remove it",
                   surface.name, i);
  const auto count = std::ssize(surface.points);
  for (size_t t = 0; t < surface.triangles.size(); ++t)
    for (const int64_t vertex : surface.triangles[t])
      if (vertex < 0 || vertex >= count)
        base::refuse("{}: triangle {} names vertex {}, but there are {} vertices (0 to {})",
                     surface.name, t, vertex, count, count - 1);
}

UnionFind fans(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  UnionFind corners(3 * std::ssize(triangles));
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
  for (int64_t c = 0; c < 3 * std::ssize(surface.triangles); ++c) {
    int64_t& vertex = surface.triangles[c / 3][c % 3];
    const int64_t fan = corners.find(c);
    if (keeper[vertex] < 0) keeper[vertex] = fan;
    if (keeper[vertex] == fan) continue;
    const auto next = std::ssize(surface.points);
    const auto [place, fresh] = copy.try_emplace(fan, next);
    const Vec3 point = surface.points[vertex];
    if (fresh) surface.points.push_back(point);
    vertex = place->second;
  }
}

}  // namespace repose::surface
