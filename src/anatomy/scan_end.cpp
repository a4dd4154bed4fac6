#include "scan_end.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

namespace repose::anatomy {
namespace {

constexpr double least_area = 60;    // mm²
constexpr double least_share = 0.5;  // of triangles with that normal; voxels of labels have steps
constexpr size_t least_corners = 6;  // a large triangle of a decimated surface has three
constexpr double flat = 0.1;         // mm
constexpr double directions = 2000;  // of normals, in a unit: they differ by less than 0.05°

/// Triangles of nearly one direction.
struct Facing {
  std::vector<int64_t> triangles;
  Vec3 scaled_normal = Vec3::Zero();  // of the largest triangle
  double area = 0;
};

std::map<std::array<int64_t, 3>, Facing> by_direction(const surface::Surface& surface) {
  std::map<std::array<int64_t, 3>, Facing> facing;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3 normal = surface::scaled_normal(surface::corners(surface, surface.triangles[t]));
    const double size = normal.norm();
    if (size == 0) continue;
    std::array<int64_t, 3> key;
    for (int axis = 0; axis < 3; ++axis) key[axis] = std::llround(directions * normal[axis] / size);
    Facing& of = facing[key];
    of.triangles.push_back(static_cast<int64_t>(t));
    of.area += size / 2;
    if (size > of.scaled_normal.norm()) of.scaled_normal = normal;
  }
  return facing;
}

}  // namespace

ScanEnd::ScanEnd(const surface::Surface& surface) {
  surface::Surface faces{surface.name, surface.points, {}};
  for (const auto& [key, facing] : by_direction(surface)) {
    if (facing.area < least_area) continue;
    const Vec3 normal = facing.scaled_normal.normalized();
    double end = -INFINITY, area = 0;
    for (const Vec3& p : surface.points) end = std::max(end, normal.dot(p));
    std::vector<Triangle> cut;
    std::set<int64_t> vertices;
    for (const int64_t t : facing.triangles) {
      const surface::Corners corners = surface::corners(surface, surface.triangles[t]);
      if (std::ranges::any_of(corners, [&](const Vec3& p) { return normal.dot(p) < end - flat; }))
        continue;
      cut.push_back(surface.triangles[t]);
      vertices.insert(cut.back().begin(), cut.back().end());
      area += surface::scaled_normal(corners).norm() / 2;
    }
    if (vertices.size() >= least_corners && area >= std::max(least_area, least_share * facing.area))
      faces.triangles.insert(faces.triangles.end(), cut.begin(), cut.end());
  }
  if (!faces.triangles.empty()) faces_.emplace(faces);
}

bool ScanEnd::within(const Vec3& point, double reach) const {
  return faces_ && faces_->nearest(point).squared <= reach * reach;
}

}  // namespace repose::anatomy
