#include "repose/surface/read.h"

#include <Eigen/Geometry>

#include "repose/base/error.h"
#include "soup.h"

namespace repose::surface {
namespace {

constexpr double largest_coordinate = 1e12;  // mm; far beyond any body, far from overflow
constexpr size_t max_corners = 1000;         // of one polygon

Soup parse(Content content) {
  switch (recognize(content)) {
    case Format::ply:
      return parse_ply(content);
    case Format::stl_text:
      return parse_stl_text(std::move(content));
    case Format::stl_binary:
      return parse_stl_binary(std::move(content));
    case Format::obj:
      return parse_obj(std::move(content));
    case Format::off:
      break;
  }
  return parse_off(std::move(content));
}

void check_points(const std::vector<Vec3>& points, const std::string& file) {
  for (size_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i];
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > largest_coordinate)
      base::refuse(
          "{}: vertex {} is at {} mm: coordinates must be finite and within ±{:g}; repair or "
          "remove it",
          file, i, p, largest_coordinate);
  }
}

void check_polygon(const std::vector<int64_t>& polygon, size_t number, size_t points,
                   const std::string& file) {
  if (polygon.size() < 3 || polygon.size() > max_corners)
    base::refuse("{}: face {} has {} corners, not 3 to {}; export a triangle mesh", file, number,
                 polygon.size(), max_corners);
  for (const int64_t vertex : polygon)
    if (vertex < 0 || vertex >= static_cast<int64_t>(points))
      base::refuse(
          "{}: face {} names vertex {} (counted from 0), but there are {} vertices; the "
          "file is damaged, export it again",
          file, number, vertex, points);
}

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

/// Cuts a simple polygon into corners − 2 triangles of the same sense by clipping ears; the polygon
/// need be neither convex nor flat (its projection along its mean normal decides). A polygon that
/// crosses itself is cut all the same. O(corners²) for the usual ones.
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

}  // namespace

Surface read_surface(const std::filesystem::path& file) {
  const std::string name = file.string();
  Soup soup = parse(read_content(file));
  if (soup.polygons.empty())
    base::refuse("{}: holds no faces (a point cloud?); export a triangle mesh", name);
  check_points(soup.points, name);
  Surface surface{name, std::move(soup.points), {}};
  surface.triangles.reserve(soup.polygons.size());
  for (size_t i = 0; i < soup.polygons.size(); ++i) {
    check_polygon(soup.polygons[i], i, surface.points.size(), name);
    triangulate(surface.points, std::move(soup.polygons[i]), surface.triangles);
  }
  return surface;
}

}  // namespace repose::surface
