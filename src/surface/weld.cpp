#include <Eigen/Geometry>
#include <map>
#include <set>

#include "repose/surface/component.h"
#include "repose/surface/distance.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"

namespace repose::surface {
namespace {

/// Keeps the first of triangles with the same three vertices, in any order.
void drop_duplicates(std::vector<Triangle>& triangles) {
  std::set<Triangle> seen;
  std::erase_if(triangles, [&](Triangle triangle) {
    std::sort(triangle.begin(), triangle.end());
    return !seen.insert(triangle).second;
  });
}

/// A triangle without area has a vertex on its longest side: merely dropped, it would leave a slit.
/// Where one triangle lies beyond that side, the pair u v b, v u d becomes b u d, d v b. One pass,
/// each triangle at most once, orientation left to Orienter; returns whether anything was flipped.
bool flip_flat_triangles(Surface& surface) {
  const auto flat = without_area(surface);
  const EdgeTable edges(surface.triangles);
  std::vector<bool> touched(surface.triangles.size(), false);
  std::set<std::pair<int64_t, int64_t>> made;
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const auto edge = edges[e];
    if (edge.size() != 2 || flat[edge[0].triangle] == flat[edge[1].triangle]) continue;
    const HalfEdge& side = flat[edge[0].triangle] ? edge[0] : edge[1];
    const HalfEdge& beyond = flat[edge[0].triangle] ? edge[1] : edge[0];
    Triangle &thin = surface.triangles[side.triangle], &wide = surface.triangles[beyond.triangle];
    if (touched[side.triangle] || touched[beyond.triangle]) continue;
    if (longest_edge(corners(surface, thin)) != side.corner) continue;
    const int64_t u = thin[side.corner], v = thin[(side.corner + 1) % 3];
    const int64_t b = thin[(side.corner + 2) % 3], d = wide[(beyond.corner + 2) % 3];
    if (b == d || edges.contains(b, d) || !made.insert(std::minmax(b, d)).second) continue;
    touched[side.triangle] = touched[beyond.triangle] = true;
    thin = {b, u, d};
    wide = {d, v, b};
  }
  return !made.empty();
}

/// Flips what can be flipped (a flip can leave another flat triangle to flip), drops the rest.
void remove_flat_triangles(Surface& surface) {
  constexpr int max_passes = 20;
  for (int pass = 0; pass < max_passes && flip_flat_triangles(surface);) ++pass;
  const auto flat = without_area(surface);
  size_t row = 0;
  std::erase_if(surface.triangles, [&](const Triangle&) { return flat[row++]; });
}

void drop_isolated_points(Surface& surface) {
  std::vector<int64_t> row(surface.points.size(), -1);
  for (const auto& triangle : surface.triangles)
    for (const int64_t vertex : triangle) row[vertex] = 0;
  std::vector<Vec3> kept;
  for (size_t i = 0; i < row.size(); ++i) {
    if (row[i] < 0) continue;
    row[i] = std::ssize(kept);
    kept.push_back(surface.points[i]);
  }
  surface.points = std::move(kept);
  for (auto& triangle : surface.triangles)
    for (auto& vertex : triangle) vertex = row[vertex];
}

struct Neighbor {
  int64_t triangle;
  bool agrees;  ///< with the orientation of this one
};

struct Part {
  std::vector<int64_t> triangles;
  bool closed = true;
  Eigen::AlignedBox3d box;
};

/// Turns triangles so that neighbors agree. Each part connected over edges of two triangles is
/// turned as a whole: a closed one outwards (inwards where it is the wall of a cavity, inside an
/// odd number of other closed parts), an open one as the majority of its triangles was.
class Orienter {
 public:
  explicit Orienter(Surface& surface)
      : surface_(surface),
        neighbors_(surface.triangles.size()),
        closed_(surface.triangles.size(), true),
        part_of_(surface.triangles.size(), -1) {
    const EdgeTable edges(surface.triangles);
    for (int64_t e = 0; e < edges.edges(); ++e) connect(edges[e]);
  }

  void run() {
    for (size_t t = 0; t < surface_.triangles.size(); ++t)
      if (part_of_[t] < 0) grow(static_cast<int64_t>(t));
    for (size_t p = 0; p < parts_.size(); ++p)
      if (parts_[p].closed && outward(parts_[p]) != (depth(p) % 2 == 0)) turn(parts_[p]);
  }

 private:
  void connect(std::span<const HalfEdge> edge) {
    if (edge.size() != 2) {
      for (const auto& half : edge) closed_[half.triangle] = false;
      return;
    }
    const bool agree = edge[0].rising != edge[1].rising;
    neighbors_[edge[0].triangle].push_back({edge[1].triangle, agree});
    neighbors_[edge[1].triangle].push_back({edge[0].triangle, agree});
  }

  void turn(int64_t triangle) {
    std::swap(surface_.triangles[triangle][1], surface_.triangles[triangle][2]);
  }

  void turn(const Part& part) {
    for (const int64_t t : part.triangles) turn(t);
  }

  /// Collects the part of `seed`, turning what disagrees with it; then with the majority.
  void grow(int64_t seed) {
    Part part;
    std::vector<bool> turned;
    const auto add = [&](int64_t triangle, bool turn_it) {
      part_of_[triangle] = std::ssize(parts_);
      part.triangles.push_back(triangle);
      turned.push_back(turn_it);
    };
    add(seed, false);
    for (size_t i = 0; i < part.triangles.size(); ++i)
      for (const auto& next : neighbors_[part.triangles[i]])
        if (part_of_[next.triangle] < 0) add(next.triangle, turned[i] == next.agrees);
    const auto count = std::count(turned.begin(), turned.end(), true);
    const bool majority = 2 * count > static_cast<std::ptrdiff_t>(turned.size());
    for (size_t i = 0; i < turned.size(); ++i) {
      const int64_t t = part.triangles[i];
      if (turned[i] != majority) turn(t);
      part.closed = part.closed && closed_[t];
      for (const int64_t vertex : surface_.triangles[t]) part.box.extend(surface_.points[vertex]);
    }
    parts_.push_back(std::move(part));
  }

  bool outward(const Part& part) const {
    return six_volumes(surface_.points, base::pick(surface_.triangles, part.triangles)) > 0;
  }

  /// Returns the number of other closed parts that contain part `p`.
  int64_t depth(size_t p) {
    const auto [a, b, c] = corners(surface_, surface_.triangles[parts_[p].triangles.front()]);
    const Vec3 inside = (a + b + c) / 3;
    int64_t around = 0;
    for (size_t q = 0; q < parts_.size(); ++q) {
      if (q == p || !parts_[q].closed || !parts_[q].box.contains(parts_[p].box)) continue;
      if (!trees_.contains(q))
        trees_.emplace(q, compact(surface_.name, surface_.points,
                                  base::pick(surface_.triangles, parts_[q].triangles)));
      if (trees_.at(q).contains(inside)) ++around;
    }
    return around;
  }

  Surface& surface_;
  std::vector<std::vector<Neighbor>> neighbors_;
  std::vector<bool> closed_;
  std::vector<int64_t> part_of_;
  std::vector<Part> parts_;
  std::map<size_t, DistanceTree> trees_;
};

}  // namespace

Surface welded(const Surface& raw) {
  Surface surface = raw;
  const auto first = coincident_points(surface.points);
  for (auto& triangle : surface.triangles)
    for (auto& vertex : triangle) vertex = first[vertex];
  std::erase_if(surface.triangles, repeats_vertex);
  return surface;
}

Surface weld_and_orient(const Surface& raw) {
  require_sound(raw);
  Surface surface = welded(raw);
  drop_duplicates(surface.triangles);
  remove_flat_triangles(surface);
  drop_isolated_points(surface);
  Orienter(surface).run();
  return surface;
}

}  // namespace repose::surface
