#include "repose/meshtools/face.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <queue>

#include "repose/base/error.h"
#include "repose/imaging/outer_skin.h"
#include "repose/imaging/taubin.h"
#include "repose/meshtools/remesh.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::meshtools {
using namespace surface;
using namespace imaging;
namespace {

constexpr double off_vertices = 1e-3;  // of an edge: a cut keeps this far from its ends

/// Builds the part that is kept.
class Cut {
 public:
  Cut(const Surface& surface, const std::vector<double>& values)
      : surface_(surface), values_(values), row_(values.size(), -1), part_{surface.name, {}, {}} {}

  void add(const Triangle& triangle) {
    std::vector<int64_t> corners;
    for (int k = 0; k < 3; ++k) {
      const int64_t a = triangle[k], b = triangle[(k + 1) % 3];
      if (inside(a)) corners.push_back(vertex(a));
      if (inside(a) != inside(b)) corners.push_back(inside(a) ? crossing(a, b) : crossing(b, a));
    }
    for (size_t k = 2; k < corners.size(); ++k)
      part_.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }

  Surface result() { return std::move(part_); }

 private:
  bool inside(int64_t v) const { return values_[v] >= 0; }

  int64_t append(const Vec3& point) {
    part_.points.push_back(point);
    return std::ssize(part_.points) - 1;
  }

  int64_t vertex(int64_t v) {
    if (row_[v] < 0) row_[v] = append(surface_.points[v]);
    return row_[v];
  }

  int64_t crossing(int64_t in, int64_t out) {
    const auto [place, fresh] = crossing_.try_emplace({in, out}, -1);
    if (!fresh) return place->second;
    const double share =
        std::clamp(values_[in] / (values_[in] - values_[out]), off_vertices, 1 - off_vertices);
    return place->second = append((1 - share) * surface_.points[in] + share * surface_.points[out]);
  }

  const Surface& surface_;
  const std::vector<double>& values_;
  std::vector<int64_t> row_;
  std::map<std::pair<int64_t, int64_t>, int64_t> crossing_;
  Surface part_;
};

/// Returns the part of a closed manifold surface with values ≥ 0, linear in its triangles: cut
/// exactly along 0.
Surface cut_at_zero(const Surface& surface, const std::vector<double>& values) {
  Cut cut(surface, values);
  for (const Triangle& triangle : surface.triangles) cut.add(triangle);
  return cut.result();
}

constexpr double beside_cap = 6;         // mm, from the skin to the end of a scan
constexpr double border_smoothing = 21;  // mm², rounds times squared edges
constexpr double coarsest_sampling = 3, sampling_per_edge = 0.75;  // mm, of the outer skin
constexpr double tolerance = 3;  // mm from the face to what it is fitted to
constexpr int fits = 4;
constexpr int relaxations = 20;
constexpr double thin = 0.93;   // cosine of an angle that is widened, 21.6°
constexpr double folded = 0.2;  // cosine between a vertex' normal and that of a triangle around it
constexpr double infinite = std::numeric_limits<double>::infinity();

VertexNeighbors neighbors_of(const Surface& surface) {
  return {EdgeTable(surface.triangles), surface.points.size()};
}

/// mm along edges from the vertices within face_near of the bones, but for those at a scan's end.
std::vector<double> path_length_from_bones(const Surface& skin, const VertexNeighbors& neighbors,
                                           const std::vector<char>& end,
                                           const FaceRequest& request) {
  using Entry = std::pair<double, int64_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  std::vector<double> length_to(skin.points.size(), infinite);
  const auto offer = [&](int64_t v, double length) {
    if (end[v] || !(length < length_to[v])) return;
    length_to[v] = length;
    front.emplace(length, v);
  };
  for (size_t v = 0; v < length_to.size(); ++v)
    for (const Vec3& place : request.places)
      if ((skin.points[v] - place).norm() <= face_near) offer(static_cast<int64_t>(v), 0);
  for (const Surface& bone : request.beneath) {
    const TriangleTree tree(bone);
    for (size_t v = 0; v < length_to.size(); ++v)
      if (tree.any_within(skin.points[v], face_near * face_near) >= 0)
        offer(static_cast<int64_t>(v), 0);
  }
  while (!front.empty()) {
    const auto [length, v] = front.top();
    front.pop();
    if (length > length_to[v]) continue;
    for (const int64_t other : neighbors[v])
      offer(other, length + (skin.points[other] - skin.points[v]).norm());
  }
  return length_to;
}

/// Vertices at the end of the scan.
std::vector<char> ends_of(const OuterSkin& outer) {
  std::vector<char> end(outer.skin.points.size(), 0);
  if (outer.caps.triangles.empty()) return end;
  const TriangleTree tree(outer.caps);
  const double reach = outside_ball + beside_cap;
  for (size_t v = 0; v < end.size(); ++v)
    end[v] = tree.any_within(outer.skin.points[v], reach * reach) >= 0;
  return end;
}

/// Makes the parts outside that the face surrounds a part of it, but where the scan ends.
void fill(const VertexNeighbors& neighbors, const std::vector<char>& end,
          std::vector<double>& inside) {
  std::vector<char> seen(inside.size(), 0);
  std::vector<std::vector<int64_t>> parts;
  for (size_t v = 0; v < inside.size(); ++v) {
    if (seen[v] || inside[v] >= 0) continue;
    std::vector<int64_t> part{static_cast<int64_t>(v)};
    seen[v] = 1;
    for (size_t next = 0; next < part.size(); ++next)
      for (const int64_t other : neighbors[part[next]])
        if (!seen[other] && inside[other] < 0) {
          seen[other] = 1;
          part.push_back(other);
        }
    parts.push_back(std::move(part));
  }
  const auto largest = std::max_element(
      parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  for (auto part = parts.begin(); part != parts.end(); ++part) {
    const auto at_end = [&](int64_t v) { return end[v] != 0; };
    if (part == largest || std::any_of(part->begin(), part->end(), at_end)) continue;
    for (const int64_t v : *part) inside[v] = 1;
  }
}

void smooth(const VertexNeighbors& neighbors, int rounds, std::vector<double>& values) {
  for (int round = 0; round < rounds; ++round) {
    const std::vector<double> old = values;
    for (size_t v = 0; v < values.size(); ++v) {
      double sum = old[v];
      for (const int64_t other : neighbors[v]) sum += old[other];
      values[v] = sum / static_cast<double>(neighbors[v].size() + 1);
    }
  }
}

/// Makes negative what spans an opening of the given skin: there the opening is nearer than the
/// given triangles. The border of the opening lies where both are equally far.
void leave_open(const OuterSkin& outer, const Surface& given, std::vector<double>& inside) {
  constexpr double beside_opening = 20;  // mm
  if (outer.openings.triangles.empty()) return;
  const TriangleTree openings(outer.openings), skin(given);
  for (size_t v = 0; v < inside.size(); ++v) {
    const Vec3& point = outer.skin.points[v];
    const double opening = openings.nearest(point, beside_opening * beside_opening).squared;
    if (!std::isfinite(opening)) continue;
    inside[v] = std::min(inside[v], std::sqrt(opening) - std::sqrt(skin.nearest(point).squared));
  }
}

/// The part of the outer skin that is solved.
Surface region_of(const OuterSkin& outer, const Surface& given, const FaceRequest& request) {
  const VertexNeighbors neighbors = neighbors_of(outer.skin);
  const std::vector<char> end = ends_of(outer);
  std::vector<double> inside(end.size(), request.margin);
  if (!request.regions.empty()) {
    for (size_t v = 0; v < end.size(); ++v) {
      const auto holds = [&](const auto& contains) { return contains(outer.skin.points[v]); };
      if (std::ranges::none_of(request.regions, holds)) inside[v] = -request.margin;
    }
  } else if (!request.beneath.empty() || !request.places.empty()) {
    inside = path_length_from_bones(outer.skin, neighbors, end, request);
    for (double& value : inside) value = request.margin - std::min(value, 2 * request.margin);
  }
  for (size_t v = 0; v < end.size(); ++v)
    if (end[v]) inside[v] = -request.margin;
  const double edge = even_edge(outer.skin);
  smooth(neighbors, static_cast<int>(std::lround(border_smoothing / (edge * edge))), inside);
  fill(neighbors, end, inside);
  leave_open(outer, given, inside);
  const Surface part = cut_at_zero(outer.skin, inside);
  if (part.triangles.empty() && !request.regions.empty())
    base::refuse("{}: nothing of it lies in the regions of tissue.face; move or enlarge them",
                 outer.skin.name);
  if (part.triangles.empty())
    base::refuse(
        "{}: nothing of it is within {:g} mm of a bone that moves; check that skin and "
        "bones come from one scan and in one frame",
        outer.skin.name, face_near);
  return largest_component(part);
}

/// The given triangles near the face: no point of the others is within the tolerance of it.
Surface part_near(const Surface& given, const TriangleTree& face) {
  Surface part{given.name, given.points, {}};
  for (const Triangle& triangle : given.triangles) {
    const Corners at = corners(given, triangle);
    const double reach = tolerance + longest_side(at);
    if (face.any_within((at[0] + at[1] + at[2]) / 3, reach * reach) >= 0)
      part.triangles.push_back(triangle);
  }
  return part;
}

/// Draws the vertices along their normals to the samples within the tolerance, which are nearest to
/// the triangles `nearest` (when last looked for, -1 at first).
void fit(const Samples& samples, const VertexNeighbors& neighbors, std::vector<int64_t>& nearest,
         Surface& face) {
  const TriangleTree tree(face);
  const std::vector<Vec3> normals = vertex_normals(face);
  std::vector<double> offset(face.points.size(), 0), weight(face.points.size(), 0);
  for (size_t s = 0; s < samples.point.size(); ++s) {
    const auto foot = tree.nearest(samples.point[s], tolerance * tolerance, nearest[s]);
    if (foot.triangle < 0) continue;
    nearest[s] = foot.triangle;
    const Triangle& triangle = face.triangles[foot.triangle];
    const Vec3 share = barycentric(tree.corners_of(foot.triangle), foot.point);
    for (int k = 0; k < 3; ++k) {
      const double part = samples.area[s] * std::max(share[k], 0.0);
      offset[triangle[k]] += part * normals[triangle[k]].dot(samples.point[s] - foot.point);
      weight[triangle[k]] += part;
    }
  }
  for (size_t v = 0; v < offset.size(); ++v) offset[v] = weight[v] > 0 ? offset[v] / weight[v] : 0;
  smooth(neighbors, 1, offset);
  for (size_t v = 0; v < offset.size(); ++v) face.points[v] += offset[v] * normals[v];
}

/// Cosine of the least angle of a triangle.
double greatest_cosine(const Corners& p) {
  double greatest = -1;
  for (int k = 0; k < 3; ++k)
    greatest = std::max(
        greatest, (p[(k + 1) % 3] - p[k]).normalized().dot((p[(k + 2) % 3] - p[k]).normalized()));
  return greatest;
}

/// Moves the corners of thin triangles towards the middle of their neighbors where that widens the
/// least angle around them (smart Laplacian smoothing; Freitag, "On combining Laplacian and
/// optimization-based mesh smoothing techniques", 1997).
void widen_angles(const VertexNeighbors& neighbors, Surface& face) {
  std::vector<std::vector<int64_t>> around(face.points.size());
  for (size_t t = 0; t < face.triangles.size(); ++t)
    for (const int64_t v : face.triangles[t]) around[v].push_back(static_cast<int64_t>(t));
  const auto cosine_at = [&](size_t v) {
    double greatest = -1;
    for (const int64_t t : around[v])
      greatest = std::max(greatest, greatest_cosine(corners(face, face.triangles[t])));
    return greatest;
  };
  bool moved = true;
  for (int round = 0; moved && round < relaxations; ++round) {
    moved = false;
    for (size_t v = 0; v < around.size(); ++v) {
      const double before = cosine_at(v);
      if (before <= thin) continue;
      const Vec3 old = face.points[v];
      const Vec3 step =
          base::mean(base::pick(face.points, neighbors[static_cast<int64_t>(v)])) - old;
      for (double share = 1; share > 0.1; share /= 2) {
        face.points[v] = old + share * step;
        if (cosine_at(v) < before) break;
        face.points[v] = old;
      }
      moved = moved || face.points[v] != old;
    }
  }
}

/// Moves vertices on folds to the middle of their neighbors until none is.
void unfold(const VertexNeighbors& neighbors, Surface& face) {
  for (int round = 0; round < relaxations; ++round) {
    const std::vector<Vec3> normals = vertex_normals(face), old = face.points;
    std::vector<char> moved(old.size(), 0);
    for (const Triangle& triangle : face.triangles) {
      const Vec3 normal = scaled_normal(corners(face, triangle)).normalized();
      for (const int64_t v : triangle)
        if (normal.dot(normals[v]) < folded)
          for (const int64_t corner : triangle) moved[corner] = 1;
    }
    if (std::count(moved.begin(), moved.end(), 1) == 0) return;
    for (size_t v = 0; v < moved.size(); ++v)
      if (moved[v])
        face.points[v] = base::mean(base::pick(old, neighbors[static_cast<int64_t>(v)]));
  }
}

/// Distances are those to the given triangles near the face: upper bounds where others are nearer.
void measure(const Surface& near, Face& face) {
  const TriangleTree tree(near);
  std::vector<double> off;
  for (const Vec3& point : face.skin.points) off.push_back(std::sqrt(tree.nearest(point).squared));
  std::sort(off.begin(), off.end());
  face.off_95 = off[static_cast<size_t>(0.95 * static_cast<double>(off.size() - 1))];
  face.off_max = off.back();
  double greatest = -1;
  for (const Triangle& triangle : face.skin.triangles)
    greatest = std::max(greatest, greatest_cosine(corners(face.skin, triangle)));
  face.min_angle = std::acos(std::min(greatest, 1.0)) * 180 / std::numbers::pi;
}

/// Openings of the given skin beside the face, and how many of them its border has.
void count_openings(const OuterSkin& outer, Face& face) {
  face.borders = inspect(face.skin, false).border_loops;
  if (outer.openings.triangles.empty()) return;
  const double reach = 3 * coarsest_sampling;
  const TriangleTree skin(face.skin);
  for (const Surface& opening : components(outer.openings))
    face.openings += std::ranges::any_of(opening.points, [&](const Vec3& point) {
      return skin.any_within(point, reach * reach) >= 0;
    });
}

}  // namespace

Face solvable_face(const Surface& given, const FaceRequest& request) {
  Face face;
  const OuterSkin outer =
      outer_skin(given, std::min(coarsest_sampling, sampling_per_edge * request.edge));
  face.skin = remesh(region_of(outer, given, request), request.edge);
  count_openings(outer, face);
  const VertexNeighbors neighbors = neighbors_of(face.skin);
  widen_angles(neighbors, face.skin);
  const Surface near = part_near(given, TriangleTree(face.skin));
  const Samples samples = sample(near, request.edge / 2);
  std::vector<int64_t> nearest(samples.point.size(), -1);
  for (int round = 0; round < fits; ++round) fit(samples, neighbors, nearest, face.skin);
  unfold(neighbors, face.skin);
  measure(near, face);
  face.skin.name = given.name;
  return face;
}

double edge_for(const Surface& given) {
  return std::clamp(bounding_diagonal(given.points) / 70, 2.0, 8.0);
}

}  // namespace repose::meshtools
