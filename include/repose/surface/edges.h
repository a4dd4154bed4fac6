#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "repose/surface/surface.h"

/// Who shares what: the edges of a triangle surface and its connected parts.
namespace repose::surface {

/// Disjoint sets of 0 … n−1.
class UnionFind {
 public:
  explicit UnionFind(int64_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

  int64_t find(int64_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  /// The smaller representative stays one, so results do not depend on the order of calls.
  void unite(int64_t a, int64_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int64_t> parent_;
};

/// One side of one triangle: from its corner `corner` to the next one.
struct HalfEdge {
  int64_t low, high;  ///< its vertices, the lower number first
  int64_t triangle;
  int corner;
  bool rising;  ///< runs from low to high

  /// The corner of the triangle, counted over all triangles, at the vertex low or high.
  int64_t corner_at_low() const { return 3 * triangle + (rising ? corner : (corner + 1) % 3); }
  int64_t corner_at_high() const { return 3 * triangle + (rising ? (corner + 1) % 3 : corner); }
};

inline bool repeats_vertex(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// All edges with the triangles at each, sorted by vertex numbers. Triangles that name a vertex
/// twice take no part. O(T log T).
class EdgeTable {
 public:
  explicit EdgeTable(const std::vector<Triangle>& triangles);

  int64_t edges() const { return std::ssize(begin_) - 1; }
  /// The half-edges of edge `i`, by triangle: one at a border, two inside a manifold.
  std::span<const HalfEdge> operator[](int64_t i) const {
    return std::span(half_edges_).subspan(begin_[i], begin_[i + 1] - begin_[i]);
  }
  bool contains(int64_t a, int64_t b) const;
  /// The half-edges at the border, in the order of the edges.
  std::vector<HalfEdge> border() const;

 private:
  std::vector<HalfEdge> half_edges_;
  std::vector<size_t> begin_;
};

/// The vertices that each vertex shares an edge with, in the order of the edges.
class VertexNeighbors {
 public:
  VertexNeighbors(const EdgeTable& edges, size_t vertices);
  std::span<const int64_t> operator[](int64_t vertex) const {
    return std::span(vertex_).subspan(begin_[vertex], begin_[vertex + 1] - begin_[vertex]);
  }

 private:
  std::vector<int64_t> begin_, vertex_;
};

/// [points] 1 at the ends of the edges of one triangle.
std::vector<char> border_vertices(const EdgeTable& edges, size_t points);

/// The triangles united that are connected by edges.
UnionFind connected(const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// The number of triangles of each part connected by edges, largest first; triangles that name a
/// vertex twice are not counted.
std::vector<int64_t> component_sizes(const std::vector<Triangle>& triangles,
                                     const EdgeTable& edges);

/// For each point the first point that it coincides with (distance ≤ 1e-9 of the bounding
/// diagonal), itself where there is none earlier. O(P) for points that do not crowd.
std::vector<int64_t> coincident_points(const std::vector<Vec3>& points);

Eigen::AlignedBox3d bounding_box(const std::vector<Vec3>& points);
double bounding_diagonal(const std::vector<Vec3>& points);  ///< mm, 0 for no points

/// Six times the signed volume under the triangles seen from the first point.
double six_volumes(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles);

/// Throws InputError naming the surface where a coordinate is not finite or an index has no point.
void require_sound(const Surface& surface);

/// Returns the corners (3 · triangle + k) united to fans: the triangles at a vertex that hang
/// together over edges of two triangles. A manifold surface has one fan at each vertex.
UnionFind fans(const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Gives every fan a point of its own: where sheets touch in a point, copies of it come last.
void split_fans(Surface& surface);

}  // namespace repose::surface
