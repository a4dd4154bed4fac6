#include "repose/tools/range_scan/range_scan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::tools::range_scan {
using namespace surface;
namespace {

/// The corners of each square of four cells, in order around it; −1 for an empty one.
template <class Visit>
void visit_squares(const RangeGrid& grid, bool ring, Visit visit) {
  for (int64_t j = 0; j + 1 < grid.rows; ++j)
    for (int64_t i = 0; i + (ring ? 0 : 1) < grid.columns; ++i) {
      const int64_t next = (i + 1) % grid.columns, a = j * grid.columns, b = a + grid.columns;
      visit(std::array<int64_t, 4>{grid.cell[a + i], grid.cell[a + next], grid.cell[b + next],
                                   grid.cell[b + i]});
    }
}

/// The median distance between points of neighboring cells.
double median_step(const RangeGrid& grid, const std::vector<Vec3>& points, bool ring) {
  std::vector<double> steps;
  visit_squares(grid, ring, [&](const std::array<int64_t, 4>& corner) {
    for (const int other : {1, 3})
      if (corner[0] >= 0 && corner[other] >= 0)
        steps.push_back((points[corner[other]] - points[corner[0]]).norm());
  });
  if (steps.empty())
    base::refuse("{}: no two neighboring cells hold points; the scan is empty", grid.name);
  return base::median(std::move(steps));
}

std::vector<Triangle> all_triangles(const RangeGrid& grid, const std::vector<Vec3>& points,
                                    bool ring) {
  std::vector<Triangle> triangles;
  visit_squares(grid, ring, [&](std::array<int64_t, 4> corner) {
    const auto empty = std::count_if(corner.begin(), corner.end(), [](auto c) { return c < 0; });
    if (empty > 1) return;
    if (empty == 1) {
      while (corner[3] >= 0) std::rotate(corner.begin(), corner.begin() + 1, corner.end());
      triangles.push_back({corner[0], corner[1], corner[2]});
      return;
    }
    const double one = (points[corner[2]] - points[corner[0]]).norm();
    const double other = (points[corner[3]] - points[corner[1]]).norm();
    if (other < one) std::rotate(corner.begin(), corner.begin() + 1, corner.end());
    triangles.push_back({corner[0], corner[1], corner[2]});
    triangles.push_back({corner[0], corner[2], corner[3]});
  });
  std::erase_if(triangles, [](const Triangle& t) { return repeats_vertex(t); });
  return triangles;
}

Vec3 to_scanner(const std::vector<Vec3>& points, const Triangle& t, bool cylinder) {
  if (!cylinder) return Vec3::UnitZ();
  Vec3 middle = points[t[0]] + points[t[1]] + points[t[2]];
  middle.y() = 0;
  return middle.normalized();
}

/// All the same way round in the grid, so one sum tells whether they face the scanner; it is of
/// unit normals, which a stray point with large triangles does not outweigh.
void face_scanner(std::vector<Triangle>& triangles, const std::vector<Vec3>& points,
                  bool cylinder) {
  double facing = 0;
  for (const Triangle& t : triangles)
    facing +=
        scaled_normal(base::pick(points, t)).normalized().dot(to_scanner(points, t, cylinder));
  if (facing >= 0) return;
  for (Triangle& t : triangles) std::swap(t[1], t[2]);
}

void cut_steps(ScanMesh& mesh, const ScanOptions& options) {
  const double min_cosine = std::cos(options.steepest * M_PI / 180);
  const auto& points = mesh.surface.points;
  std::erase_if(mesh.surface.triangles, [&](const Triangle& t) {
    const Corners at = base::pick(points, t);
    const bool too_long = longest_side(at) > mesh.longest_edge;
    const Vec3 normal = scaled_normal(at).normalized();
    const bool steep = normal.dot(to_scanner(points, t, options.cylinder)) < min_cosine;
    mesh.cut_long += too_long;
    mesh.cut_steep += steep && !too_long;
    return too_long || steep;
  });
}

void keep_largest(ScanMesh& mesh) {
  std::vector<Triangle>& triangles = mesh.surface.triangles;
  const auto all = std::ssize(triangles);
  UnionFind parts = connected(triangles, EdgeTable(triangles));
  std::vector<int64_t> size(all, 0);
  for (int64_t t = 0; t < all; ++t) ++size[parts.find(t)];
  const int64_t largest = std::max_element(size.begin(), size.end()) - size.begin();
  int64_t t = 0;
  std::erase_if(triangles, [&](const Triangle&) { return parts.find(t++) != largest; });
  mesh.dropped = all - std::ssize(triangles);
}

/// Gives each fan of triangles at a point a point of its own, and drops points without triangles.
void renumber(ScanMesh& mesh, const PointData& data) {
  std::vector<Triangle>& triangles = mesh.surface.triangles;
  UnionFind corners = fans(triangles, EdgeTable(triangles));
  std::map<int64_t, int64_t> row;  // of the fan's first corner
  std::vector<int64_t> source;
  for (int64_t c = 0; c < 3 * std::ssize(triangles); ++c) {
    int64_t& vertex = triangles[c / 3][c % 3];
    const auto [place, fresh] = row.try_emplace(corners.find(c), std::ssize(row));
    if (fresh) source.push_back(vertex);
    vertex = place->second;
  }
  std::vector<bool> used(mesh.surface.points.size(), false);
  std::vector<Vec3> points;
  for (auto& field : mesh.data.fields) field.values.clear();
  for (const int64_t from : source) {
    mesh.split += used[from];
    used[from] = true;
    points.push_back(mesh.surface.points[from]);
    if (!data.colors.empty()) mesh.data.colors.push_back(data.colors[from]);
    for (size_t f = 0; f < data.fields.size(); ++f)
      mesh.data.fields[f].values.push_back(data.fields[f].values[from]);
  }
  mesh.unused = std::count(used.begin(), used.end(), false);
  mesh.surface.points = std::move(points);
}

}  // namespace

ScanMesh mesh_of(const RangeGrid& grid, const ScanOptions& options) {
  ScanMesh mesh;
  mesh.surface.name = grid.name;
  mesh.surface.points = grid.points;
  for (Vec3& point : mesh.surface.points) point *= options.scale;
  const auto& points = mesh.surface.points;
  mesh.longest_edge = options.longest_edge > 0 ? options.longest_edge
                                               : 4 * median_step(grid, points, options.cylinder);
  mesh.surface.triangles = all_triangles(grid, points, options.cylinder);
  face_scanner(mesh.surface.triangles, points, options.cylinder);
  cut_steps(mesh, options);
  if (mesh.surface.triangles.empty())
    base::refuse("{}: no triangle with edges ≤ {:g} mm and less steep than {:g}°; allow more",
                 grid.name, mesh.longest_edge, options.steepest);
  if (options.largest) keep_largest(mesh);
  mesh.data.fields = grid.data.fields;
  renumber(mesh, grid.data);
  return mesh;
}

std::vector<double> hole_lengths(const Surface& surface) {
  const EdgeTable edges(surface.triangles);
  const std::vector<HalfEdge> border = edges.border();
  const auto points = std::ssize(surface.points);
  UnionFind loops(points), parts(points);
  for (int64_t e = 0; e < edges.edges(); ++e)
    parts.unite(edges[e].front().low, edges[e].front().high);
  for (const HalfEdge& half : border) loops.unite(half.low, half.high);
  std::map<int64_t, std::map<int64_t, double>> lengths;  // [part][loop]
  for (const HalfEdge& half : border)
    lengths[parts.find(half.low)][loops.find(half.low)] +=
        (surface.points[half.high] - surface.points[half.low]).norm();
  std::vector<double> holes;
  for (const auto& [part, borders] : lengths) {
    std::vector<double> sorted;
    for (const auto& [loop, length] : borders) sorted.push_back(length);
    std::sort(sorted.begin(), sorted.end());
    holes.insert(holes.end(), sorted.begin(), sorted.end() - 1);
  }
  std::sort(holes.rbegin(), holes.rend());
  return holes;
}

}  // namespace repose::tools::range_scan
