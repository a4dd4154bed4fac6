#include "repose/surface/read.h"

#include "polygon.h"
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
