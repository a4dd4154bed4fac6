#include "line_winding.h"

#include <limits>

#include "cgal.h"

namespace repose::surface {

namespace {

/// Returns whether the upward edge from `low` to `high` crosses the half-line from (y, z) in +y
/// direction.
bool crosses_beyond(const Vec3& low, const Vec3& high, const Kernel::Point_2& point) {
  return CGAL::left_turn(Kernel::Point_2(low.y(), low.z()), Kernel::Point_2(high.y(), high.z()),
                         point);
}

/// The winding number of a triangle's projection along x around (y, z): 1, 0 or −1. The upper end
/// of an edge belongs to it, the lower one does not, and an edge through the point does not cross
/// the half-line, as if the point lay a little farther in +y and, far less, in −z.
int triangle_winding(const Corners& corners, double y, double z) {
  const Kernel::Point_2 point(y, z);
  int winding = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &from = corners[k], &to = corners[(k + 1) % 3];
    if (from.z() < z && to.z() >= z)
      winding += crosses_beyond(from, to, point);
    else if (to.z() < z && from.z() >= z)
      winding -= crosses_beyond(to, from, point);
  }
  return winding;
}

}  // namespace

std::vector<LineCrossing> line_crossings(const TriangleTree& tree, double y, double z) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::vector<LineCrossing> crossings;
  tree.overlapping(TriangleTree::Box{{-infinite, y, z}, {infinite, y, z}}, [&](int64_t triangle) {
    const int winding = triangle_winding(tree.corners_of(triangle), y, z);
    if (winding != 0) crossings.push_back({triangle, winding});
    return false;
  });
  return crossings;
}

int winding_number(const TriangleTree& tree, std::span<const LineCrossing> crossings,
                   const Vec3& point) {
  int sum = 0;
  for (const auto& [triangle, winding] : crossings) {
    const Corners& t = tree.corners_of(triangle);
    const auto side =
        CGAL::orientation(to_cgal(t[0]), to_cgal(t[1]), to_cgal(t[2]), to_cgal(point));
    if (static_cast<int>(side) * winding < 0) sum += winding;
  }
  return sum;
}

}  // namespace repose::surface
