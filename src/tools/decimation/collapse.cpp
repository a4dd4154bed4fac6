#include "collapse.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <queue>

#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"

namespace repose::tools::decimation {
using namespace surface;
namespace {

/// Least cosine between a triangle's normal before and after a step.
constexpr double min_turn = 0.2;
/// Least height of a triangle over its longest edge, as a share of that edge.
constexpr double min_height = 1e-3;
/// Times a point outside the tolerance may pull a placement back in.
constexpr int max_pulls = 4;
/// Passes over the edges end when one removes less than this share of the triangles.
constexpr double idle_pass = 1e-3;

bool has(const Triangle& triangle, int64_t vertex) {
  return std::find(triangle.begin(), triangle.end(), vertex) != triangle.end();
}

Triangle with(Triangle triangle, int64_t old_vertex, int64_t vertex) {
  std::replace(triangle.begin(), triangle.end(), old_vertex, vertex);
  return triangle;
}

/// Share of the corner `k` at the point's place on the triangle.
double share_of_corner(const Corners& t, int k, const Vec3& point) {
  const Vec3 normal = scaled_normal(t);
  return (t[(k + 1) % 3] - point).cross(t[(k + 2) % 3] - point).dot(normal) / normal.squaredNorm();
}

/// All corners of one triangle strictly on one side of the other's plane, by more than rounding.
bool beside(const Corners& a, const Corners& b) {
  const Vec3 normal = scaled_normal(a);
  const double noise = 1e-10 * normal.norm() * (1 + a[0].norm());
  const auto height = [&](const Vec3& corner) { return normal.dot(corner - a[0]); };
  const auto [low, high] = std::minmax({height(b[0]), height(b[1]), height(b[2])});
  return low > noise || high < -noise;
}

/// meet, with a look in doubles before the exact one.
bool cross(const Triangle& a, const Corners& a_corners, const Triangle& b,
           const Corners& b_corners) {
  const bool share = has(b, a[0]) || has(b, a[1]) || has(b, a[2]);
  if (!share && (beside(a_corners, b_corners) || beside(b_corners, a_corners))) return false;
  return meet(a, a_corners, b, b_corners);
}

}  // namespace

Collapser::Collapser(const Surface& surface, const std::vector<char>& locked)
    : surface_(surface),
      tree_(surface),
      dead_(surface.triangles.size(), false),
      alive_(std::ssize(surface.triangles)),
      origin_(surface.points[0]) {
  for (const char at : locked) vertices_.push_back({.locked = at != 0});
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    Corners c = corners(surface, surface.triangles[t]);
    for (Vec3& corner : c) corner -= origin_;
    const Quadric plane = Quadric::of(c);
    for (const int64_t vertex : surface.triangles[t]) {
      vertices_[vertex].triangles.push_back(static_cast<int64_t>(t));
      vertices_[vertex].quadric = vertices_[vertex].quadric + plane;
    }
  }
}

Collapser::Candidate Collapser::candidate(int64_t a, int64_t b) const {
  if (vertices_[b].locked) std::swap(a, b);
  const Quadric sum = vertices_[a].quadric + vertices_[b].quadric;
  const Vec3 middle = 0.5 * (surface_.points[a] + surface_.points[b]) - origin_;
  const Vec3 at = vertices_[a].locked ? Vec3(surface_.points[a] - origin_) : sum.minimizer(middle);
  const double length = (surface_.points[a] - surface_.points[b]).squaredNorm();
  const double cost = std::max(sum.at(at), 0.0) + 1e-9 * length * length;
  return {cost, a, b, vertices_[a].version, vertices_[b].version};
}

std::vector<int64_t> Collapser::neighbors(int64_t vertex) const {
  std::vector<int64_t> found;
  for (const int64_t t : vertices_[vertex].triangles)
    for (const int64_t other : surface_.triangles[t])
      if (other != vertex) found.push_back(other);
  base::sort_unique(found);
  return found;
}

/// Link condition: the neighbors that both ends share are the corners opposite the edge.
bool Collapser::gather(int64_t kept, int64_t removed, Star& star) const {
  for (const int64_t t : vertices_[kept].triangles)
    (has(surface_.triangles[t], removed) ? star.dying : star.staying).push_back(t);
  for (const int64_t t : vertices_[removed].triangles)
    if (!has(surface_.triangles[t], kept)) star.staying.push_back(t);
  const auto a = neighbors(kept), b = neighbors(removed);
  std::vector<int64_t> both;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  return !star.dying.empty() && both.size() == star.dying.size() && !star.staying.empty();
}

/// Where the vertex that stays may go, best first: the quadric's minimizer, the middle, the ends.
std::vector<Vec3> Collapser::placements(int64_t kept, int64_t removed) const {
  const Vec3 &a = surface_.points[kept], &b = surface_.points[removed];
  if (vertices_[kept].locked) return {a};
  const Vec3 middle = 0.5 * (a + b);
  const Quadric sum = vertices_[kept].quadric + vertices_[removed].quadric;
  return {origin_ + sum.minimizer(middle - origin_), middle, a, b};
}

bool Collapser::shapes_stay(const Star& star) const {
  for (size_t i = 0; i < star.staying.size(); ++i) {
    const Corners& t = new_corners_[i];
    const Vec3 now = scaled_normal(t);
    const Vec3 before = scaled_normal(corners(surface_, surface_.triangles[star.staying[i]]));
    const double area = now.norm();
    const int k = longest_edge(t);
    if (!(area > min_height * (t[(k + 1) % 3] - t[k]).squaredNorm())) return false;
    if (now.dot(before) < min_turn * area * before.norm()) return false;
  }
  return true;
}

/// A look at a few points of each triangle first: most placements that fail do so there.
bool Collapser::within(Vec3* outside) const {
  if (!tolerance_) return true;
  const auto near = [&](const Vec3& point) {
    const bool inside = tolerance_->contains(point);
    if (!inside) *outside = point;
    return inside;
  };
  for (const auto& [a, b, c] : new_corners_)
    if (!near(a) || !near(b) || !near(c) || !near((a + b + c) / 3) || !near(0.5 * (a + b)) ||
        !near(0.5 * (b + c)) || !near(0.5 * (c + a)))
      return false;
  return std::all_of(new_corners_.begin(), new_corners_.end(),
                     [&](const Corners& t) { return tolerance_->contains(t, outside); });
}

bool Collapser::meets_another(const Star& star) const {
  const auto goes = [&](int64_t t) {
    return std::ranges::count(star.staying, t) + std::ranges::count(star.dying, t) > 0;
  };
  for (size_t i = 0; i < new_corners_.size(); ++i) {
    for (size_t j = 0; j < i; ++j)
      if (cross(new_triangles_[i], new_corners_[i], new_triangles_[j], new_corners_[j]))
        return true;
    if (tree_.overlapping(TriangleTree::box_of(new_corners_[i]), [&](int64_t t) {
          const Triangle& other = surface_.triangles[t];
          return !goes(t) &&
                 cross(new_triangles_[i], new_corners_[i], other, corners(surface_, other));
        }))
      return true;
  }
  return false;
}

bool Collapser::fits(const Star& star, int64_t kept, int64_t removed, const Vec3& at,
                     Vec3* outside) {
  new_triangles_.clear();
  new_corners_.clear();
  for (const int64_t t : star.staying) {
    const Triangle triangle = with(surface_.triangles[t], removed, kept);
    Corners places = corners(surface_, triangle);
    for (int k = 0; k < 3; ++k)
      if (triangle[k] == kept) places[k] = at;
    new_triangles_.push_back(triangle);
    new_corners_.push_back(places);
  }
  return shapes_stay(star) && within(outside) && !meets_another(star);
}

bool Collapser::attempt(const Candidate& c) {
  Star star;
  if (!gather(c.kept, c.removed, star)) return false;
  for (Vec3 at : placements(c.kept, c.removed))
    for (int pull = 0; pull <= max_pulls; ++pull) {
      Vec3 outside = Vec3::Constant(NAN);
      if (fits(star, c.kept, c.removed, at, &outside)) {
        collapse(star, c.kept, c.removed, at);
        return true;
      }
      if (vertices_[c.kept].locked || !tolerance_ || !outside.allFinite() || pull == max_pulls)
        break;
      at = pulled(c.kept, at, outside);
    }
  return false;
}

/// Moves a placement so that the point outside the tolerance comes to its edge.
Vec3 Collapser::pulled(int64_t kept, const Vec3& at, const Vec3& outside) const {
  const Vec3 nearest = tolerance_->nearest(outside);
  const double distance = (nearest - outside).norm();
  if (!(distance > 0)) return at;
  double share = 0.25;
  for (size_t i = 0; i < new_corners_.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      if (new_triangles_[i][k] != kept) continue;
      Vec3 foot;
      if (squared_distance(outside, new_corners_[i], &foot) > 1e-18 * (1 + outside.squaredNorm()))
        continue;
      share = std::max(share, share_of_corner(new_corners_[i], k, outside));
    }
  const double inward = 1 - 0.9 * std::min(1.0, tolerance_->distance() / distance);
  return at + inward / std::min(share, 1.0) * (nearest - outside);
}

void Collapser::collapse(const Star& star, int64_t kept, int64_t removed, const Vec3& at) {
  ++steps_;
  surface_.points[kept] = at;
  vertices_[kept].quadric = vertices_[kept].quadric + vertices_[removed].quadric;
  for (const int64_t t : star.dying) {
    dead_[t] = true;
    tree_.remove(t);
    --alive_;
    for (const int64_t vertex : surface_.triangles[t]) std::erase(vertices_[vertex].triangles, t);
  }
  for (size_t i = 0; i < star.staying.size(); ++i) {
    surface_.triangles[star.staying[i]] = new_triangles_[i];
    tree_.exchange(star.staying[i], new_corners_[i]);
    for (const int64_t vertex : new_triangles_[i]) vertices_[vertex].changed = steps_;
  }
  vertices_[kept].triangles = star.staying;
  vertices_[removed].triangles.clear();
  ++vertices_[kept].version;
  ++vertices_[removed].version;
}

int64_t Collapser::pass(int64_t target, uint64_t since, const std::function<void()>& report) {
  std::priority_queue<Candidate> queue;
  const auto offer = [&](int64_t a, int64_t b) {
    if (!vertices_[a].locked || !vertices_[b].locked) queue.push(candidate(a, b));
  };
  for (size_t t = 0; t < surface_.triangles.size(); ++t) {
    const Triangle& triangle = surface_.triangles[t];
    for (int k = 0; k < 3 && !dead_[t]; ++k) {
      const int64_t a = triangle[k], b = triangle[(k + 1) % 3];
      if (std::max(vertices_[a].changed, vertices_[b].changed) > since) offer(a, b);
    }
  }
  const int64_t before = alive_;
  for (int64_t tried = 0; !queue.empty() && alive_ > target; ++tried) {
    const Candidate best = queue.top();
    queue.pop();
    if (tried % 256 == 0) report();
    if (vertices_[best.kept].version != best.kept_version ||
        vertices_[best.removed].version != best.removed_version)
      continue;
    if (!attempt(best)) continue;
    for (const int64_t neighbor : neighbors(best.kept)) offer(best.kept, neighbor);
  }
  return before - alive_;
}

void Collapser::run(int64_t target, const Tolerance* tolerance,
                    const std::function<void()>& report) {
  tolerance_ = tolerance;
  uint64_t since = 0;
  int64_t gone = 0;
  do {
    const uint64_t now = steps_;
    gone = pass(target, since, report);
    since = now;
  } while (alive_ > target && static_cast<double>(gone) > idle_pass * static_cast<double>(alive_));
}

Surface Collapser::result() const {
  std::vector<Triangle> left;
  for (size_t t = 0; t < surface_.triangles.size(); ++t)
    if (!dead_[t]) left.push_back(surface_.triangles[t]);
  return compact(surface_.name, surface_.points, std::move(left));
}

}  // namespace repose::tools::decimation
