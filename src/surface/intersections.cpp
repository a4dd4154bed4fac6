#include "intersections.h"

#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <array>

#include "cgal.h"

namespace repose::surface {
namespace {

using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, int64_t>;

/// Whether two triangles with area meet outside the vertices that they share by number.
class PairTest {
 public:
  explicit PairTest(const Surface& surface) : surface_(surface) {}

  bool operator()(int64_t s, int64_t t) const {
    Triangle a = surface_.triangles[s], b = surface_.triangles[t];
    const int shared = shared_first(a, b);
    if (shared == 0) return CGAL::do_intersect(to_cgal(surface_, a), to_cgal(surface_, b));
    if (shared == 1)
      return CGAL::do_intersect(segment(a[1], a[2]), to_cgal(surface_, b)) ||
             CGAL::do_intersect(segment(b[1], b[2]), to_cgal(surface_, a));
    if (shared == 2) return folded(a, b);
    return true;
  }

 private:
  /// Brings shared vertices to the front of both; returns how many there are.
  static int shared_first(Triangle& a, Triangle& b) {
    int shared = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = shared; j < 3; ++j)
        if (a[i] == b[j]) {
          std::swap(a[i], a[shared]);
          std::swap(b[j], b[shared]);
          ++shared;
          break;
        }
    return shared;
  }

  /// Neighbours over an edge overlap only when they lie in one plane, on one side of the edge.
  bool folded(const Triangle& a, const Triangle& b) const {
    const Point3 p = point(a[0]), q = point(a[1]), r = point(a[2]), s = point(b[2]);
    return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
  }

  Point3 point(int64_t i) const { return to_cgal(surface_.points[i]); }
  Segment3 segment(int64_t i, int64_t j) const { return {point(i), point(j)}; }

  const Surface& surface_;
};

}  // namespace

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
  const PairTest meet(surface);
  std::vector<std::pair<int64_t, int64_t>> pairs;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
    if (meet(a.info(), b.info())) pairs.push_back(std::minmax(a.info(), b.info()));
  });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace repose::surface
