#include "polygon.h"

#include <Eigen/Geometry>

namespace repose::surface {
namespace {

/// Twice the vector area (Newell's normal).
Vec3 vector_area(const std::vector<Vec3>& points, const std::vector<int64_t>& polygon) {
  Vec3 area = Vec3::Zero();
  const Vec3& origin = points[polygon[0]];
  for (size_t i = 1; i + 1 < polygon.size(); ++i)
    area += (points[polygon[i]] - origin).cross(points[polygon[i + 1]] - origin);
  return area;
}

/// The polygon seen along its normal.
struct View {
  const std::vector<Vec3>& points;
  Vec3 normal;

  double turn(int64_t a, int64_t b, int64_t c) const {
    return normal.dot((points[b] - points[a]).cross(points[c] - points[a]));
  }

  bool is_ear(const std::vector<int64_t>& polygon, size_t corner) const {
    const size_t n = polygon.size();
    const int64_t a = polygon[(corner + n - 1) % n], b = polygon[corner];
    const int64_t c = polygon[(corner + 1) % n];
    if (turn(a, b, c) <= 0) return false;
    for (const int64_t p : polygon) {
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
  }
};

}  // namespace

void triangulate(const std::vector<Vec3>& points, std::vector<int64_t> polygon,
                 std::vector<Triangle>& triangles) {
  const View view{points, vector_area(points, polygon)};
  while (polygon.size() > 3) {
    const size_t n = polygon.size();
    size_t ear = 1;  // of a quadrilateral or a polygon without any, clip what a fan would
    for (size_t k = 0; k < n; ++k) {
      const size_t corner = (1 + k) % n;
      if (!view.is_ear(polygon, corner)) continue;
      ear = corner;
      break;
    }
    triangles.push_back({polygon[(ear + n - 1) % n], polygon[ear], polygon[(ear + 1) % n]});
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({polygon[0], polygon[1], polygon[2]});
}

}  // namespace repose::surface
