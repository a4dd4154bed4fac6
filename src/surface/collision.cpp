#include "repose/surface/collision.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::surface {
namespace {

using Node = CollisionTree::Node;

/// The shortest way between two triangles.
struct ShortestSegment {
  double squared;  ///< mm², 0 where they intersect
  Vec3 middle;     ///< mm, its middle
};

void offer(const Vec3& p, const Vec3& q, ShortestSegment& best) {
  const double squared = (p - q).squaredNorm();
  if (squared < best.squared) best = {squared, (p + q) / 2};
}

double clamped(double value) { return std::clamp(value, 0.0, 1.0); }

/// Nearest points of the segments p + s d, q + t e.
void sides(const Vec3& p, const Vec3& d, const Vec3& q, const Vec3& e, ShortestSegment& best) {
  const Vec3 r = p - q;
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e), dr = d.dot(r),
               er = e.dot(r), determinant = dd * ee - de * de;
  double s = determinant > 0 ? clamped((de * er - dr * ee) / determinant) : 0;
  double t = ee > 0 ? (de * s + er) / ee : 0;
  if (t < 0 || t > 1) {
    t = clamped(t);
    s = dd > 0 ? clamped((de * t - dr) / dd) : 0;
  }
  offer(p + s * d, q + t * e, best);
}

/// Returns whether the foot of `p` on the plane of `t` lies in it, for the unscaled normal n.
bool above(const Vec3& p, const Corners& t, const Vec3& n) {
  for (int k = 0; k < 3; ++k)
    if (n.cross(t[(k + 1) % 3] - t[k]).dot(p - t[k]) < 0) return false;
  return true;
}

/// Corners of `a` over triangle `b`, and sides of `a` that cross it.
void corners_and_crossings(const Corners& a, const Corners& b, ShortestSegment& best) {
  const Vec3 n = (b[1] - b[0]).cross(b[2] - b[0]);
  const double nn = n.squaredNorm();
  if (!(nn > 0)) return;
  std::array<double, 3> height;
  for (int k = 0; k < 3; ++k) {
    height[k] = n.dot(a[k] - b[0]);
    if (height[k] * height[k] < best.squared * nn && above(a[k], b, n))
      offer(a[k], a[k] - height[k] / nn * n, best);
  }
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (!(height[k] * height[next] < 0)) continue;
    const Vec3 at = a[k] + height[k] / (height[k] - height[next]) * (a[next] - a[k]);
    if (above(at, b, n)) best = {0, at};
  }
}

/// From the nine pairs of sides, the six of a corner and the other triangle, and the crossings of a
/// side and the other triangle (Ericson, Real-Time Collision Detection, 2005, ch. 5). Where
/// rounding hides a crossing, a side or a corner is within rounding of the other triangle.
ShortestSegment shortest_segment(const Corners& a, const Corners& b) {
  ShortestSegment best{std::numeric_limits<double>::infinity(), a[0]};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      sides(a[i], a[(i + 1) % 3] - a[i], b[j], b[(j + 1) % 3] - b[j], best);
  corners_and_crossings(a, b, best);
  corners_and_crossings(b, a, best);
  return best;
}

/// A pose with what the boxes need of it.
struct Placement {
  explicit Placement(const Mat4& pose)
      : turn(pose.topLeftCorner<3, 3>()),
        shift(pose.topRightCorner<3, 1>()),
        spread(turn.cwiseAbs()) {}

  Corners apply(const Corners& t) const {
    return {turn * t[0] + shift, turn * t[1] + shift, turn * t[2] + shift};
  }
  /// Distance between box a and a box b placed so, at most the true one: the greater of those to
  /// the upright boxes around one in the frame of the other.
  double minimum(const Node& a, const Node& b) const {
    const Vec3 between = turn * b.center + shift - a.center;
    const Vec3 in_a = between.cwiseAbs() - a.half - spread * b.half;
    const Vec3 in_b =
        (turn.transpose() * between).cwiseAbs() - b.half - spread.transpose() * a.half;
    return std::sqrt(std::max(in_a.cwiseMax(0).squaredNorm(), in_b.cwiseMax(0).squaredNorm()));
  }

  Mat3 turn;
  Vec3 shift;
  Mat3 spread;
};

/// Between the triangles of leaf i of a and leaf j of b.
ShortestSegment between(const CollisionTree& a, int64_t i, const CollisionTree& b, int64_t j,
                        const Placement& place) {
  return shortest_segment(a.corners(a.nodes()[i].triangle),
                          place.apply(b.corners(b.nodes()[j].triangle)));
}

/// Visits pairs of nodes, the more promising of two first. `key(i, j)` is what the pair may come to
/// at best, `bound()` what is no longer wanted, `leaf(i, j)` takes a pair of leaves.
template <class Key, class Bound, class Leaf>
void traverse(const CollisionTree& a, const CollisionTree& b, Key&& key, Bound&& bound,
              Leaf&& leaf) {
  struct Task {
    int64_t i, j;
    double key;
  };
  const auto task = [&](int64_t i, int64_t j) -> Task { return {i, j, key(i, j)}; };
  std::vector<Task> stack{task(0, 0)};
  while (!stack.empty()) {
    const auto [i, j, best] = stack.back();
    stack.pop_back();
    if (!(best <= bound())) continue;
    const Node &p = a.nodes()[i], &q = b.nodes()[j];
    if (p.right < 0 && q.right < 0) {
      leaf(i, j);
      continue;
    }
    const bool split_a = q.right < 0 || (p.right >= 0 && p.half.sum() > q.half.sum());
    const Task first = split_a ? task(i + 1, j) : task(i, j + 1),
               second = split_a ? task(p.right, j) : task(i, q.right);
    stack.push_back(first.key < second.key ? second : first);
    stack.push_back(first.key < second.key ? first : second);
  }
}

/// Visits pairs of leaves, nearer nodes first, while `bound()` mm is not exceeded: `leaf` takes
/// their triangles and the shortest segment between these.
template <class Bound, class Leaf>
void visit_leaves(const CollisionTree& a, const CollisionTree& b, const Mat4& pose, Bound&& bound,
                  Leaf&& leaf) {
  const Placement place(pose);
  traverse(
      a, b, [&](int64_t i, int64_t j) { return place.minimum(a.nodes()[i], b.nodes()[j]); }, bound,
      [&](int64_t i, int64_t j) {
        leaf(std::array{a.nodes()[i].triangle, b.nodes()[j].triangle}, between(a, i, b, j, place));
      });
}

}  // namespace

CollisionTree::CollisionTree(const Surface& surface) {
  require_sound(surface);
  if (surface.triangles.empty())
    base::refuse("{}: no triangle to collide with; check the mesh", surface.name);
  for (const Triangle& t : surface.triangles) corners_.push_back(base::pick(surface.points, t));
  std::vector<int64_t> rows = base::all_rows(corners_.size());
  nodes_.reserve(2 * rows.size());
  build(rows, 0, rows.size());
}

void CollisionTree::build(std::vector<int64_t>& rows, size_t begin, size_t end) {
  Eigen::AlignedBox3d box, middles;
  const auto middle = [&](int64_t row) -> Vec3 {
    return corners_[row][0] + corners_[row][1] + corners_[row][2];
  };
  for (size_t k = begin; k < end; ++k) {
    for (const Vec3& corner : corners_[rows[k]]) box.extend(corner);
    middles.extend(middle(rows[k]));
  }
  const size_t self = nodes_.size();
  nodes_.push_back({box.center(), box.sizes() / 2, -1, rows[begin]});
  if (end - begin == 1) return;
  int axis;
  middles.sizes().maxCoeff(&axis);
  const size_t half = (begin + end) / 2;
  std::nth_element(rows.begin() + begin, rows.begin() + half, rows.begin() + end,
                   [&](int64_t s, int64_t t) { return middle(s)[axis] < middle(t)[axis]; });
  build(rows, begin, half);
  nodes_[self].right = std::ssize(nodes_);
  build(rows, half, end);
}

bool touch(const CollisionTree& a, const CollisionTree& b, const Mat4& pose, double margin) {
  bool found = false;
  visit_leaves(
      a, b, pose, [&] { return found ? -1 : margin; },
      [&](const auto&, const ShortestSegment& pair) {
        found = found || pair.squared <= margin * margin;
      });
  return found;
}

std::optional<ClosestApproach> nearest(const CollisionTree& a, const CollisionTree& b,
                                       const Mat4& pose, double limit) {
  ClosestApproach best{.distance = limit};
  visit_leaves(
      a, b, pose, [&] { return best.distance; },
      [&](const auto& triangles, const ShortestSegment& pair) {
        const double distance = std::sqrt(pair.squared);
        if (distance < best.distance || (best.triangles[0] < 0 && distance <= best.distance))
          best = {distance, triangles, pair.middle};
      });
  if (best.triangles[0] < 0) return {};
  return best;
}

std::vector<std::pair<int64_t, int64_t>> pairs_within(const CollisionTree& a,
                                                      const CollisionTree& b, const Mat4& pose,
                                                      double limit) {
  std::vector<std::pair<int64_t, int64_t>> pairs;
  visit_leaves(
      a, b, pose, [&] { return limit; },
      [&](const auto& triangles, const ShortestSegment& pair) {
        if (pair.squared <= limit * limit) pairs.emplace_back(triangles[0], triangles[1]);
      });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

namespace {

bool is_near(const Corners& t, const CollisionTree& other, double near) {
  const CollisionTree alone({"triangle", {t[0], t[1], t[2]}, {{0, 1, 2}}});
  return touch(alone, other, Mat4::Identity(), near);
}

/// [triangles of a] 1 where one lies within `near` mm of b. Of all pairs there may be too many.
std::vector<char> triangles_near(const CollisionTree& a, const CollisionTree& b, double near) {
  std::vector<char> found(a.triangles());
  for (int64_t t = 0; t < a.triangles(); ++t) found[t] = is_near(a.corners(t), b, near);
  return found;
}

void append_triangle(const Corners& t, Surface& soup) {
  const auto first = std::ssize(soup.points);
  soup.points.insert(soup.points.end(), t.begin(), t.end());
  soup.triangles.push_back({first, first + 1, first + 2});
}

}  // namespace

Surface refine_near(const Surface& surface, const CollisionTree& own, const CollisionTree& other,
                    double near, double longest) {
  const std::vector<char> touching = triangles_near(own, other, near);
  Surface result{surface.name, surface.points, {}};
  std::vector<Corners> left;
  for (size_t t = 0; t < touching.size(); ++t) {
    if (touching[t])
      left.push_back(own.corners(static_cast<int64_t>(t)));
    else
      result.triangles.push_back(surface.triangles[t]);
  }
  while (!left.empty()) {
    const Corners t = left.back();
    left.pop_back();
    if (longest_side(t) <= longest || !is_near(t, other, near)) {
      append_triangle(t, result);
      continue;
    }
    const Vec3 a = (t[1] + t[2]) / 2, b = (t[2] + t[0]) / 2, c = (t[0] + t[1]) / 2;
    for (const Corners& part : {Corners{t[0], c, b}, {t[1], a, c}, {t[2], b, a}, {a, b, c}})
      left.push_back(part);
  }
  return result;
}

Encounter::Side Encounter::make_side(const CollisionTree& tree, const Twist& twist) {
  Side side{&tree, {}, {}, {}};
  for (const Node& node : tree.nodes())
    side.speed.push_back((twist.angular.cross(node.center) + twist.linear).norm() +
                         twist.angular.norm() * node.half.norm());
  return side;
}

void Encounter::summarize(Side& side) {
  const auto& nodes = side.tree->nodes();
  side.only_such.assign(nodes.size(), 0);
  for (size_t i = nodes.size(); i-- > 0;)
    side.only_such[i] = nodes[i].right < 0
                            ? side.ignored[nodes[i].triangle]
                            : side.only_such[i + 1] && side.only_such[nodes[i].right];
}

Encounter::Encounter(const CollisionTree& a, const CollisionTree& b, const Twist& twist_a,
                     const Twist& twist_b, double touching,
                     const std::array<std::vector<char>, 2>& inside)
    : a_(make_side(a, twist_a)), b_(make_side(b, twist_b)) {
  const auto ignore = [&](Side& side, const CollisionTree& other, const std::vector<char>& more) {
    side.ignored = triangles_near(*side.tree, other, touching);
    for (size_t t = 0; t < more.size(); ++t) side.ignored[t] |= more[t];
    summarize(side);
  };
  ignore(a_, b, inside[0]);
  ignore(b_, a, inside[1]);
}

double Encounter::ignored_area() const {
  double twice = 0;
  for (const Side* side : {&a_, &b_})
    for (int64_t t = 0; t < side->tree->triangles(); ++t) {
      const auto& [a, b, c] = side->tree->corners(t);
      if (side->ignored[t]) twice += (b - a).cross(c - a).norm();
    }
  return twice / 2;
}

Encounter::Next Encounter::next(const Mat4& pose, double clearance) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const CollisionTree &a = *a_.tree, &b = *b_.tree;
  const Placement place(pose);
  Next next{never, {}};
  const std::array<int64_t, 2> last = std::exchange(last_, {-1, -1});
  const auto time = [&](double distance, int64_t i, int64_t j) {
    const double speed = a_.speed[i] + b_.speed[j];
    return speed > 0 ? std::max(0.0, distance - clearance - contact_margin) / speed : never;
  };
  const auto key = [&](int64_t i, int64_t j) {
    if (a_.only_such[i] && b_.only_such[j]) return never;
    return time(place.minimum(a.nodes()[i], b.nodes()[j]), i, j);
  };
  const auto leaf = [&](int64_t i, int64_t j) {
    const ShortestSegment pair = between(a, i, b, j, place);
    const double distance = std::sqrt(pair.squared), load = time(distance, i, j);
    if (!(load < next.load)) return;
    next = {load, {distance, {a.nodes()[i].triangle, b.nodes()[j].triangle}, pair.middle}};
    last_ = {i, j};
  };
  if (last[0] >= 0) leaf(last[0], last[1]);
  traverse(
      a, b, key, [&] { return next.load > 0 ? std::min(next.load, 2.0) : -1; }, leaf);
  return next;
}

}  // namespace repose::surface
