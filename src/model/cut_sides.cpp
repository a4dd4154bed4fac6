#include "cut_sides.h"

#include <algorithm>
#include <map>

#include "repose/base/error.h"

namespace repose::model {
namespace {

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

/// The corner so many steps counter-clockwise of another one.
int64_t corner(const Triangle& t, int64_t vertex, int steps) {
  return t[(std::find(t.begin(), t.end(), vertex) - t.begin() + steps) % 3];
}

}  // namespace

CutSides::CutSides(const std::vector<int64_t>& columns, const std::vector<Triangle>& triangles) {
  std::map<int64_t, std::vector<int64_t>> around;
  for (size_t i = 0; i + 1 < columns.size(); ++i) {
    cut_edges_.insert(base::sorted_pair(columns[i], columns[i + 1]));
    if (i > 0) parted_.insert(columns[i]);
  }
  for (size_t row = 0; row < triangles.size(); ++row)
    for (const int64_t v : triangles[row])
      if (parted(v)) around[v].push_back(static_cast<int64_t>(row));
  for (size_t i = 1; i + 1 < columns.size(); ++i)
    walk(columns[i - 1], columns[i], columns[i + 1], triangles, around[columns[i]]);
}

bool CutSides::in_cut(int64_t a, int64_t b) const {
  return cut_edges_.contains(base::sorted_pair(a, b));
}

bool CutSides::left_edge(int64_t vertex, int64_t other) const {
  return left_edges_.contains({vertex, other});
}

bool CutSides::left_triangle(int64_t vertex, const Triangle& corners) const {
  return left_triangles_.contains({vertex, sorted(corners)});
}

void CutSides::walk(int64_t before, int64_t vertex, int64_t after,
                    const std::vector<Triangle>& triangles, const std::vector<int64_t>& around) {
  int64_t edge = after;  // counter-clockwise from here
  for (size_t steps = 0; edge != before; ++steps) {
    const auto next = std::find_if(around.begin(), around.end(), [&](int64_t row) {
      return corner(triangles[row], vertex, 1) == edge;
    });
    if (next == around.end() || steps > around.size())
      throw base::InternalError(fmt::format("vertex {} is not inside a path of edges", vertex));
    left_triangles_.insert({vertex, sorted(triangles[*next])});
    edge = corner(triangles[*next], vertex, 2);
    if (edge != before) left_edges_.insert({vertex, edge});
  }
}

}  // namespace repose::model
