#pragma once
#include <vector>

#include "repose/surface/surface.h"

namespace repose::model {

/// A triangle surface whose edges and triangles can be split, in place. New vertices and triangles
/// come at the end of their lists. Edges have at most two triangles.
class SplitMesh {
 public:
  explicit SplitMesh(surface::Surface& surface);

  const Vec3& point(int64_t vertex) const { return surface_.points[vertex]; }
  const Triangle& triangle(int64_t row) const { return surface_.triangles[row]; }
  const std::vector<int64_t>& triangles_of(int64_t vertex) const { return around_[vertex]; }
  bool has_edge(int64_t a, int64_t b) const { return !triangles_of_edge(a, b).empty(); }
  bool on_border(int64_t vertex) const;
  /// Mean length of a triangle's edges, mm.
  double edge_length(int64_t triangle) const;

  /// Both return the new vertex.
  int64_t split_edge(int64_t a, int64_t b, const Vec3& at);
  int64_t split_triangle(int64_t row, const Vec3& at);

 private:
  std::vector<int64_t> triangles_of_edge(int64_t a, int64_t b) const;
  int64_t add_vertex(const Vec3& at);
  void put(int64_t row, const Triangle& corners);
  void remove(int64_t row);

  surface::Surface& surface_;
  std::vector<std::vector<int64_t>> around_;  // [P] triangles of a vertex
};

}  // namespace repose::model
