#include "repose/imaging/outer_skin.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "distance_volume.h"
#include "flat_parts.h"
#include "repose/base/error.h"
#include "repose/imaging/isosurface.h"
#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"

namespace repose::imaging {
using namespace surface;
namespace {

constexpr double max_voxels = 3e7;
constexpr double open_end = 150;   // mm, length of the border loop where a head is cut off
constexpr double open_mouth = 60;  // mm, least length of the border loop of an open mouth
constexpr double cap_area = 3000;  // mm²
constexpr double on_cone = 1.05;   // of the ball's radius

/// Triangles from the middle of every border loop to its edges: of those that a ball would pass,
/// of those so long that the head ends there, and of those of an open mouth.
struct Cones {
  Surface all, ends, openings;
};

struct BorderLoop {
  double length = 0;        // mm
  Vec3 sum = Vec3::Zero();  // mm², of the middles of its sides, by their lengths
  std::vector<std::array<Vec3, 2>> sides;
};

/// Loops of border edges by one of their vertices.
std::map<int64_t, BorderLoop> border_loops(const Surface& surface) {
  const EdgeTable edges(surface.triangles);
  UnionFind loops(static_cast<int64_t>(surface.points.size()));
  for (int64_t e = 0; e < edges.edges(); ++e)
    if (edges[e].size() == 1) loops.unite(edges[e].front().low, edges[e].front().high);
  std::map<int64_t, BorderLoop> of_vertex;
  for (int64_t e = 0; e < edges.edges(); ++e) {
    if (edges[e].size() != 1) continue;
    const Vec3 &a = surface.points[edges[e].front().low],
               &b = surface.points[edges[e].front().high];
    BorderLoop& loop = of_vertex[loops.find(edges[e].front().low)];
    loop.length += (b - a).norm();
    loop.sum += (b - a).norm() * (a + b) / 2;
    loop.sides.push_back({a, b});
  }
  return of_vertex;
}

Cones cones_of(const Surface& surface, double passes) {
  Cones cones;
  const auto add = [](const BorderLoop& loop, Surface& cone) {
    for (const auto& [a, b] : loop.sides) {
      const auto first = static_cast<int64_t>(cone.points.size());
      cone.points.insert(cone.points.end(), {a, b, loop.sum / loop.length});
      cone.triangles.push_back({first, first + 1, first + 2});
    }
  };
  for (const auto& [vertex, loop] : border_loops(surface)) {
    if (loop.length > passes) add(loop, cones.all);
    if (loop.length > open_end)
      add(loop, cones.ends);
    else if (loop.length > open_mouth)
      add(loop, cones.openings);
  }
  return cones;
}

/// Makes `distance` negative but where {distance ≥ radius} is connected with the grid's corner:
/// −radius is then the border of the outside, and larger values lie nearer to the solid.
void keep_outside(double radius, Volume& distance) {
  std::vector<char> reached(distance.values.size(), 0);
  std::vector<int64_t> front{0};
  reached[0] = 1;
  while (!front.empty()) {
    const int64_t voxel = front.back();
    front.pop_back();
    distance.visit_neighbors(voxel, [&](int64_t next) {
      if (reached[next] || distance.values[next] < radius) return;
      reached[next] = 1;
      front.push_back(next);
    });
  }
  for (size_t v = 0; v < reached.size(); ++v)
    distance.values[v] = reached[v] || distance.values[v] < radius ? -distance.values[v] : 0;
}

/// Every `stride`-th sample along each axis.
Volume thinned(const Volume& volume, int64_t stride) {
  Volume thin{volume.name, {}, static_cast<double>(stride) * volume.axes, volume.origin, {}, {}};
  for (int a = 0; a < 3; ++a) thin.size[a] = (volume.size[a] - 1) / stride + 1;
  for (int64_t k = 0; k < volume.size[2]; k += stride)
    for (int64_t j = 0; j < volume.size[1]; j += stride)
      for (int64_t i = 0; i < volume.size[0]; i += stride)
        thin.values.push_back(volume.at(i, j, k));
  return thin;
}

double voxel_for(const Surface& surface, const Rolling& rolling, double margin) {
  const Vec3 size = bounding_box(surface.points).sizes() + Vec3::Constant(2 * margin);
  return std::max(rolling.voxel, std::cbrt(size.prod() / max_voxels));
}

/// The parts of the border of the outside, `radius` away from the skin, that lie over the scan's
/// ends.
Surface caps_of(const Surface& border, const Surface& ends, double radius) {
  std::vector<char> cap = flat_parts(border, cap_area);
  if (!ends.triangles.empty()) {
    const TriangleTree tree(ends);
    const double near = on_cone * on_cone * radius * radius;
    for (size_t t = 0; t < border.triangles.size(); ++t) {
      const Corners at = corners(border, border.triangles[t]);
      if (tree.any_within((at[0] + at[1] + at[2]) / 3, near) >= 0) cap[t] = 1;
    }
  }
  Surface caps{border.name, border.points, {}};
  for (size_t t = 0; t < cap.size(); ++t)
    if (cap[t]) caps.triangles.push_back(border.triangles[t]);
  return caps;
}

}  // namespace

OuterSkin outer_skin(const Surface& given, const Rolling& rolling) {
  Surface solid = welded(given);
  if (solid.triangles.empty()) base::refuse("{}: holds no triangle", given.name);
  const Cones cones = cones_of(solid, 6 * rolling.outside);
  append(cones.all, solid);
  const double margin = rolling.outside + 3 * rolling.voxel;
  const double voxel = voxel_for(solid, rolling, margin);
  constexpr double edges = 1.5;  // of a grid, beyond a level, on which distances are looked up
  Volume field = distance_volume(solid, voxel, margin, rolling.outside + edges * voxel);
  keep_outside(rolling.outside, field);
  const Surface outside = largest_component(isosurface(field, -rolling.outside));
  for (float& value : field.values) value = value >= -rolling.outside ? 1 : 0;
  const double core = rolling.outside + rolling.inside;
  field = distance_volume(outside, std::move(field), core + edges * voxel);
  if (*std::max_element(field.values.begin(), field.values.end()) <= core)
    base::refuse(
        "{}: nothing of it is {:g} mm thick; for a skin that is no solid (a sheet, or a head open "
        "at several ends) leave tissue.edge out",
        given.name, 2 * rolling.inside);
  const Surface inner = largest_component(isosurface(field, core));
  for (float& value : field.values) value = value < core ? 1 : 0;
  const int64_t stride = std::max(int64_t{1}, static_cast<int64_t>(rolling.sampling / voxel));
  field = distance_volume(inner, std::move(field),
                          rolling.inside + edges * static_cast<double>(stride) * voxel);
  for (float& value : field.values) value = -value;
  if (stride > 1) field = thinned(field, stride);
  return {largest_component(isosurface(field, -rolling.inside)),
          caps_of(outside, cones.ends, rolling.outside), rolling.outside, welded(cones.openings)};
}

}  // namespace repose::imaging
