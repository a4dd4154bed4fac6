#include "cut_sheets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "repose/base/error.h"
#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"
#include "repose/surface/triangle_tree.h"

namespace repose::meshtools {
using namespace surface;
namespace {

constexpr int disc_corners = 96;
constexpr double phase = 0.0123;  // rad: the corners lie in no plane of symmetry of a bone

/// One triangle, so that it is exactly flat, around a disc.
Surface wide_triangle(const Vec3& middle, const Vec3& u, const Vec3& v, double radius) {
  const double side = std::sqrt(3.0);
  return {"plane",
          {middle + 2 * radius * u, middle + radius * (side * v - u),
           middle + radius * (-side * v - u)},
          {{0, 1, 2}}};
}

Surface disc(const Vec3& middle, const Vec3& u, const Vec3& v, double radius) {
  Surface sheet{"plane", {middle}, {}};
  for (int64_t k = 0; k < disc_corners; ++k) {
    const double angle = phase + 2 * std::numbers::pi * static_cast<double>(k) / disc_corners;
    sheet.points.push_back(middle + radius * (std::cos(angle) * u + std::sin(angle) * v));
    sheet.triangles.push_back({0, k + 1, (k + 1) % disc_corners + 1});
  }
  return sheet;
}

Surface plane_sheet(const CutPlane& plane, const Surface& bone, double offset) {
  const Vec3 normal = plane.normal.normalized();
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  if (std::isfinite(plane.radius)) return disc(plane.point + offset * normal, u, v, plane.radius);
  const Eigen::AlignedBox3d box = bounding_box(bone.points);
  const Vec3 from = box.center() - plane.point;
  const Vec3 middle = plane.point + from - from.dot(normal) * normal;
  return wide_triangle(middle + offset * normal, u, v, 1.1 * box.diagonal().norm() + 1);
}

/// Each vertex moved so that the planes of the triangles around it move by `distance`, or by less
/// where they are folded sharply.
Surface offset_sheet(const Surface& sheet, double distance) {
  constexpr double min_cosine = 0.3;
  const std::vector<Vec3> normals = angle_normals(sheet);
  std::vector<double> cosine(sheet.points.size(), 1);
  for (const Triangle& t : sheet.triangles)
    for (const int64_t i : t)
      cosine[i] =
          std::min(cosine[i], normals[i].dot(scaled_normal(corners(sheet, t)).normalized()));
  Surface moved = sheet;
  for (size_t i = 0; i < normals.size(); ++i)
    moved.points[i] += distance / std::max(cosine[i], min_cosine) * normals[i];
  return moved;
}

/// The strip between the borders of two sheets with the same triangles, facing away from them.
Surface wall(const Surface& upper, const Surface& lower) {
  Surface strip{"wall of the kerf", upper.points, {}};
  const auto shift = std::ssize(upper.points);
  strip.points.insert(strip.points.end(), lower.points.begin(), lower.points.end());
  for (const HalfEdge& h : EdgeTable(upper.triangles).border()) {
    const int64_t from = h.rising ? h.low : h.high, to = h.rising ? h.high : h.low;
    strip.triangles.push_back({to, from, from + shift});
    strip.triangles.push_back({to, from + shift, to + shift});
  }
  return strip;
}

void append_slab(Surface upper, Surface lower, bool walled, std::vector<CutSheet>& sheets) {
  if (walled) {
    Surface strip = wall(upper, lower);
    if (!strip.triangles.empty()) sheets.push_back({std::move(strip), Side::none, Side::kerf});
  }
  sheets.push_back({std::move(upper), Side::ahead, Side::kerf});
  sheets.push_back({std::move(lower), Side::kerf, Side::behind});
}

void refuse_self_intersection(const Surface& sheet, double kerf) {
  const auto pairs = self_intersections(sheet);
  if (pairs.empty()) return;
  base::refuse(
      "{}: the cutting surface intersects itself{}, first triangles {} and {}; repair it in a mesh "
      "editor{}",
      sheet.name, kerf > 0 ? fmt::format(" when moved by half the kerf of {} mm", kerf) : "",
      pairs[0].first, pairs[0].second, kerf > 0 ? " or make the kerf smaller" : "");
}

}  // namespace

std::vector<CutSheet> cut_sheets(const Surface& bone, const Osteotomy& plan, double shift) {
  std::vector<CutSheet> sheets;
  const double half = plan.kerf / 2;
  for (const CutPlane& plane : plan.planes) {
    if (plan.kerf > 0)
      append_slab(plane_sheet(plane, bone, shift + half), plane_sheet(plane, bone, shift - half),
                  std::isfinite(plane.radius), sheets);
    else
      sheets.push_back({plane_sheet(plane, bone, shift), Side::ahead, Side::behind});
  }
  if (!plan.surface) return sheets;
  refuse_self_intersection(*plan.surface, 0);
  const Surface upper = offset_sheet(*plan.surface, shift + half);
  if (!(plan.kerf > 0)) {
    sheets.push_back({upper, Side::ahead, Side::behind});
    return sheets;
  }
  const Surface lower = offset_sheet(*plan.surface, shift - half);
  refuse_self_intersection(upper, plan.kerf);
  refuse_self_intersection(lower, plan.kerf);
  append_slab(upper, lower, true, sheets);
  return sheets;
}

}  // namespace repose::meshtools
