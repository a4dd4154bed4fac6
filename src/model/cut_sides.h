#pragma once
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "repose/surface/surface.h"

namespace repose::model {

/// On which side of a path of edges the triangles and edges lie that meet it.
class CutSides {
 public:
  /// `columns` are the path's vertices. InternalError where they are no path inside the surface.
  CutSides(const std::vector<int64_t>& columns, const std::vector<Triangle>& triangles);

  /// Returns whether a vertex lies on the path, not at its tips.
  bool parted(int64_t vertex) const { return parted_.contains(vertex); }
  /// Returns whether an edge belongs to the path.
  bool in_cut(int64_t a, int64_t b) const;
  /// Returns whether an edge from a parted vertex, not in the cut, lies left of the path.
  bool left_edge(int64_t vertex, int64_t other) const;
  /// Returns whether a triangle around a parted vertex lies left of the path, its corners in any
  /// order.
  bool left_triangle(int64_t vertex, const Triangle& corners) const;

 private:
  /// Finds what lies left of a parted vertex between its neighbors on the path.
  void walk(int64_t before, int64_t vertex, int64_t after, const std::vector<Triangle>& triangles,
            const std::vector<int64_t>& around);

  std::set<int64_t> parted_;
  std::set<std::array<int64_t, 2>> cut_edges_, left_edges_;
  std::set<std::pair<int64_t, Triangle>> left_triangles_;
};

}  // namespace repose::model
