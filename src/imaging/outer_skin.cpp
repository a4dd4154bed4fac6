#include "repose/imaging/outer_skin.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "distance_volume.h"
#include "repose/base/error.h"
#include "repose/imaging/isosurface.h"
#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"

namespace repose::imaging {
using namespace surface;
namespace {

constexpr double beside_plane = 0.5;  // mm
constexpr double min_cosine = 0.95;
constexpr int64_t seed_every = 40;
constexpr int refits = 3;

struct Plane {
  Vec3 point, normal;
};

/// Triangles with what growing a part asks of them.
class Parts {
 public:
  explicit Parts(const Surface& surface) : beside_(surface.triangles.size(), {-1, -1, -1}) {
    const EdgeTable edges(surface.triangles);
    for (int64_t e = 0; e < edges.edges(); ++e)
      if (edges[e].size() == 2) {
        beside_[edges[e][0].triangle][edges[e][0].corner] = edges[e][1].triangle;
        beside_[edges[e][1].triangle][edges[e][1].corner] = edges[e][0].triangle;
      }
    for (const Triangle& triangle : surface.triangles) {
      const Corners at = corners(surface, triangle);
      center_.push_back((at[0] + at[1] + at[2]) / 3);
      normal_.push_back(scaled_normal(at) / 2);
    }
    last_visit_.assign(beside_.size(), -1);
  }

  Plane at(int64_t triangle) const { return {center_[triangle], normal_[triangle].normalized()}; }

  /// The triangles around `seed` that are near the plane, and the plane that fits them better.
  std::vector<int64_t> grow(int64_t seed, Plane& plane, double& area) {
    std::vector<int64_t> part{seed};
    last_visit_[seed] = ++visit_;
    area = 0;
    Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
    for (size_t next = 0; next < part.size(); ++next) {
      const int64_t t = part[next];
      area += normal_[t].norm();
      point += normal_[t].norm() * center_[t];
      normal += normal_[t];
      for (const int64_t other : beside_[t]) {
        if (other < 0 || last_visit_[other] == visit_ || !fits(other, plane)) continue;
        last_visit_[other] = visit_;
        part.push_back(other);
      }
    }
    plane = {point / area, normal.normalized()};
    return part;
  }

 private:
  bool fits(int64_t t, const Plane& plane) const {
    return std::abs((center_[t] - plane.point).dot(plane.normal)) < beside_plane &&
           normal_[t].dot(plane.normal) > min_cosine * normal_[t].norm();
  }

  std::vector<Triangle> beside_;
  std::vector<Vec3> center_, normal_;  ///< mm; mm², the length is the area
  std::vector<int64_t> last_visit_;
  int64_t visit_ = 0;
};

/// Returns a flag for each triangle [T]: 1 in connected parts of at least `area` mm² that lie
/// within 0.5 mm of a plane and face as it does (within 18°): where a scan ends, or a table. O(T)
/// but for parts that are nearly as large and not flat.
std::vector<char> flat_parts(const Surface& surface, double area) {
  Parts parts(surface);
  std::vector<char> flat(surface.triangles.size(), 0), small(flat.size(), 0);
  for (int64_t seed = 0; seed < std::ssize(flat); seed += seed_every) {
    if (flat[seed] || small[seed]) continue;
    Plane plane = parts.at(seed);
    double grown = 0;
    std::vector<int64_t> part;
    for (int fit = 0; fit <= refits && (fit == 0 || grown > area / 20); ++fit)
      part = parts.grow(seed, plane, grown);
    if (grown >= area)
      for (const int64_t t : part) flat[t] = 1;
    else if (grown < area / 2)
      for (const int64_t t : part) small[t] = 1;
  }
  return flat;
}

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
  const std::vector<HalfEdge> border = EdgeTable(surface.triangles).border();
  UnionFind loops(std::ssize(surface.points));
  for (const HalfEdge& half : border) loops.unite(half.low, half.high);
  std::map<int64_t, BorderLoop> of_vertex;
  for (const HalfEdge& half : border) {
    const Vec3 &a = surface.points[half.low], &b = surface.points[half.high];
    BorderLoop& loop = of_vertex[loops.find(half.low)];
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
      const auto first = std::ssize(cone.points);
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

/// The parts of the border of the outside that lie over the scan's ends.
Surface caps_of(const Surface& border, const Surface& ends) {
  std::vector<char> cap = flat_parts(border, cap_area);
  if (!ends.triangles.empty()) {
    const TriangleTree tree(ends);
    const double near = on_cone * on_cone * outside_ball * outside_ball;
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

OuterSkin outer_skin(const Surface& given, double sampling) {
  Surface solid = welded(given);
  if (solid.triangles.empty()) base::refuse("{}: holds no triangle", given.name);
  const Cones cones = cones_of(solid, 6 * outside_ball);
  append(cones.all, solid);
  constexpr double finest = 1.5, margin = outside_ball + 3 * finest;  // mm
  const Vec3 size = bounding_box(solid.points).sizes() + Vec3::Constant(2 * margin);
  const double voxel = std::max(finest, std::cbrt(size.prod() / max_voxels));
  constexpr double edges = 1.5;  // of a grid, beyond a level, on which distances are looked up
  Volume field = distance_volume(solid, voxel, margin, outside_ball + edges * voxel);
  keep_outside(outside_ball, field);
  const Surface outside = largest_component(isosurface(field, -outside_ball));
  for (float& value : field.values) value = value >= -outside_ball ? 1 : 0;
  constexpr double core = outside_ball + inside_ball;
  field = distance_volume(outside, std::move(field), core + edges * voxel);
  if (*std::max_element(field.values.begin(), field.values.end()) <= core)
    base::refuse(
        "{}: nothing of it is {:g} mm thick; for a skin that is no solid (a sheet, or a head open "
        "at several ends) leave tissue.edge out",
        given.name, 2 * inside_ball);
  const Surface inner = largest_component(isosurface(field, core));
  for (float& value : field.values) value = value < core ? 1 : 0;
  const int64_t stride = std::max(int64_t{1}, static_cast<int64_t>(sampling / voxel));
  field = distance_volume(inner, std::move(field),
                          inside_ball + edges * static_cast<double>(stride) * voxel);
  for (float& value : field.values) value = -value;
  if (stride > 1) field = thinned(field, stride);
  return {largest_component(isosurface(field, -inside_ball)), caps_of(outside, cones.ends),
          welded(cones.openings)};
}

}  // namespace repose::imaging
