#include "repose/surface/intersections.h"

#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <array>

#include "cgal.h"

namespace repose::surface {
namespace {

using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, int64_t>;

/// A triangle whose vertices can be brought into another order, numbers and places alike.
struct Numbered {
  Triangle numbers;
  std::array<Point3, 3> points;

  Numbered(const Triangle& vertices, const Corners& corners)
      : numbers(vertices), points{to_cgal(corners[0]), to_cgal(corners[1]), to_cgal(corners[2])} {}

  void swap(int i, int j) {
    std::swap(numbers[i], numbers[j]);
    std::swap(points[i], points[j]);
  }
  Triangle3 triangle() const { return {points[0], points[1], points[2]}; }
  Segment3 opposite() const { return {points[1], points[2]}; }
};

/// Brings shared vertices to the front of both; returns how many there are.
int shared_first(Numbered& a, Numbered& b) {
  int shared = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = shared; j < 3; ++j)
      if (a.numbers[i] == b.numbers[j]) {
        a.swap(i, shared);
        b.swap(j, shared);
        ++shared;
        break;
      }
  return shared;
}

/// Neighbors over an edge overlap only when they lie in one plane, on one side of the edge.
bool folded(const Numbered& a, const Numbered& b) {
  const auto& [p, q, r] = a.points;
  const Point3& s = b.points[2];
  return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
}

}  // namespace

bool meet(const Triangle& a, const Corners& a_corners, const Triangle& b,
          const Corners& b_corners) {
  Numbered s(a, a_corners), t(b, b_corners);
  const int shared = shared_first(s, t);
  if (shared == 0) return CGAL::do_intersect(s.triangle(), t.triangle());
  if (shared == 1)
    return CGAL::do_intersect(s.opposite(), t.triangle()) ||
           CGAL::do_intersect(t.opposite(), s.triangle());
  if (shared == 2) return folded(s, t);
  return true;
}

std::vector<bool> without_area(const Surface& surface) {
  std::vector<bool> flags;
  flags.reserve(surface.triangles.size());
  for (const auto& triangle : surface.triangles)
    flags.push_back(to_cgal(surface, triangle).is_degenerate());
  return flags;
}

std::vector<std::pair<int64_t, int64_t>> self_intersections(const Surface& surface) {
  const std::vector<bool> flat = without_area(surface);
  std::vector<Box> boxes;
  for (size_t t = 0; t < surface.triangles.size(); ++t)
    if (!flat[t])
      boxes.emplace_back(to_cgal(surface, surface.triangles[t]).bbox(), static_cast<int64_t>(t));
  std::vector<std::pair<int64_t, int64_t>> pairs;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
    const Triangle &s = surface.triangles[a.info()], &t = surface.triangles[b.info()];
    if (meet(s, corners(surface, s), t, corners(surface, t)))
      pairs.push_back(std::minmax(a.info(), b.info()));
  });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

std::vector<std::pair<int64_t, int64_t>> new_intersections(const Surface& before,
                                                           const Surface& now) {
  std::vector<std::pair<int64_t, int64_t>> pairs = self_intersections(now);
  std::erase_if(pairs, [&](const auto& pair) {
    const Triangle &a = before.triangles[pair.first], &b = before.triangles[pair.second];
    return meet(a, corners(before, a), b, corners(before, b));
  });
  return pairs;
}

}  // namespace repose::surface
