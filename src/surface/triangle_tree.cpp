#include "repose/surface/triangle_tree.h"

#include <algorithm>
#include <cmath>

namespace repose::surface {
namespace {

constexpr int64_t leaf_size = 4;

/// Returns the point of a triangle nearest to `q`, by barycentric regions.
Vec3 closest_point(const Vec3& q, const Corners& t) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = q - t[0], bp = q - t[1], cp = q - t[2];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
               d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return t[0];
  if (d3 >= 0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + d1 / (d1 - d3) * ab;
  if (d6 >= 0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4, from_b = d4 - d3, from_c = d5 - d6;
  if (va <= 0 && from_b >= 0 && from_c >= 0)
    return t[1] + from_b / (from_b + from_c) * (t[2] - t[1]);
  const double sum = va + vb + vc;
  return t[0] + vb / sum * ab + vc / sum * ac;
}

}  // namespace

Vec3 scaled_normal(const Corners& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

Vec3 barycentric(const Corners& t, const Vec3& point) {
  const Vec3 normal = scaled_normal(t);
  const double area = normal.squaredNorm();
  const double a = (t[2] - t[1]).cross(point - t[1]).dot(normal) / area;
  const double b = (t[0] - t[2]).cross(point - t[2]).dot(normal) / area;
  return {a, b, 1 - a - b};
}

int longest_edge(const Corners& t) {
  int longest = 0;
  Vec3((t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm())
      .maxCoeff(&longest);
  return longest;
}

double longest_side(const Corners& t) {
  return std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
}

double squared_distance(const Vec3& query, const Corners& triangle, Vec3* closest) {
  const Vec3 point = closest_point(query, triangle);
  if (closest) *closest = point;
  return (point - query).squaredNorm();
}

bool TriangleTree::Box::overlaps(const Box& box) const {
  return (low.array() <= box.high.array()).all() && (box.low.array() <= high.array()).all();
}

TriangleTree::Box TriangleTree::box_of(const Corners& corners) {
  Box box;
  if (std::isnan(corners[0].x())) return box;
  for (const Vec3& corner : corners) box.extend(corner);
  return box;
}

TriangleTree::TriangleTree(const Surface& surface)
    : order_(base::all_rows(surface.triangles.size())),
      row_(order_.size()),
      leaf_of_(order_.size()) {
  std::vector<Vec3> centers;
  centers.reserve(order_.size());
  for (const auto& triangle : surface.triangles) {
    const auto [a, b, c] = corners(surface, triangle);
    centers.push_back((a + b + c) / 3);
  }
  nodes_.reserve(order_.size());
  build(0, std::ssize(order_), -1, centers);
  sorted_.reserve(order_.size());
  for (const int64_t t : order_) {
    row_[t] = std::ssize(sorted_);
    sorted_.push_back(corners(surface, surface.triangles[t]));
  }
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) node->box = box_around(*node);
}

int64_t TriangleTree::build(int64_t first, int64_t end, int64_t parent,
                            const std::vector<Vec3>& centers) {
  const auto number = std::ssize(nodes_);
  nodes_.push_back({{}, first, end - first, -1, parent});
  if (end - first <= leaf_size) {
    for (int64_t i = first; i < end; ++i) leaf_of_[order_[i]] = number;
    return number;
  }
  Box box;
  for (int64_t i = first; i < end; ++i) box.extend(centers[order_[i]]);
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const auto middle = first + (end - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + end,
                   [&](int64_t s, int64_t t) { return centers[s][axis] < centers[t][axis]; });
  build(first, middle, number, centers);
  const int64_t right = build(middle, end, number, centers);
  nodes_[number].right = right;
  nodes_[number].count = 0;
  return number;
}

/// Visits the rows of leaves, the child with the lesser key first, while the key of their nodes
/// is allowed: `key(node)` mm², `allowed(key)`, `visit(row)`.
template <class Key, class Allowed, class Visit>
void TriangleTree::walk(Key&& key, Allowed&& allowed, Visit&& visit) const {
  struct Entry {  // left without a value in the array
    double key;
    int64_t node;
  };
  std::array<Entry, max_depth> stack;
  int depth = 0;
  stack[depth++] = {key(nodes_[0]), 0};
  while (depth > 0) {
    const auto [least, number] = stack[--depth];
    if (!allowed(least)) continue;
    const Node& node = nodes_[number];
    for (int64_t i = node.first; i < node.first + node.count; ++i) visit(i);
    if (node.count > 0) continue;
    Entry left{key(nodes_[number + 1]), number + 1}, right{key(nodes_[node.right]), node.right};
    if (left.key < right.key) std::swap(left, right);
    stack[depth++] = left;
    stack[depth++] = right;
  }
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3& query, double limit, int64_t hint) const {
  Nearest best;
  best.squared = limit;
  const auto offer = [&](int64_t row) {
    Vec3 point;
    const double squared = squared_distance(query, sorted_[row], &point);
    if (squared < best.squared) best = {squared, order_[row], point};
  };
  if (hint >= 0) offer(row_[hint]);
  walk([&](const Node& node) { return node.box.squared_distance(query); },
       [&](double least) { return least < best.squared; }, offer);
  return best;
}

int64_t TriangleTree::any_within(const Vec3& query, double limit, int64_t hint) const {
  if (hint >= 0 && squared_distance(query, corners_of(hint)) <= limit) return hint;
  int64_t found = -1;
  const auto offer = [&](int64_t row) {
    if (found < 0 && squared_distance(query, sorted_[row]) <= limit) found = order_[row];
  };
  walk([&](const Node& node) { return node.box.squared_distance(query); },
       [&](double least) { return found < 0 && least <= limit; }, offer);
  return found;
}

double TriangleTree::min_max(std::span<const Vec3> points, double enough) const {
  double best = std::numeric_limits<double>::infinity();
  const auto to_box = [&](const Node& node) {
    double greatest = 0;
    for (const Vec3& point : points)
      greatest = std::max(greatest, node.box.squared_distance(point));
    return greatest;
  };
  const auto offer = [&](int64_t row) {
    double greatest = 0;
    for (size_t i = 0; i < points.size() && greatest < best; ++i)
      greatest = std::max(greatest, squared_distance(points[i], sorted_[row]));
    best = std::min(best, greatest);
  };
  walk(
      to_box, [&](double least) { return best > enough && least < best; }, offer);
  return best;
}

bool TriangleTree::one_covers(std::span<const Vec3> points, double limit, int64_t& hint) const {
  const auto covers = [&](int64_t t) {
    for (const Vec3& point : points)
      if (squared_distance(point, corners_of(t)) > limit) return false;
    hint = t;
    return true;
  };
  if (hint >= 0 && covers(hint)) return true;
  struct Reaching {  // a box that serves reaches as far as all points, but for the margin
    Vec3 low, high;
    bool overlaps(const Box& box) const {
      return (box.low.array() <= low.array()).all() && (box.high.array() >= high.array()).all();
    }
  };
  Box box;
  for (const Vec3& point : points) box.extend(point);
  const double margin = std::sqrt(limit);
  const Reaching region{box.low.array() + margin, box.high.array() - margin};
  return overlapping(region, [&](int64_t t) { return t != hint && covers(t); });
}

void TriangleTree::exchange(int64_t triangle, const Corners& corners) {
  sorted_[row_[triangle]] = corners;
  refit(leaf_of_[triangle]);
}

void TriangleTree::remove(int64_t triangle) {
  exchange(triangle, {Vec3::Constant(NAN), Vec3::Constant(NAN), Vec3::Constant(NAN)});
}

TriangleTree::Box TriangleTree::box_around(const Node& node) const {
  Box box;
  for (int64_t i = node.first; i < node.first + node.count; ++i) box.extend(box_of(sorted_[i]));
  if (node.right < 0) return box;
  box = (&node + 1)->box;
  box.extend(nodes_[node.right].box);
  return box;
}

void TriangleTree::refit(int64_t number) {
  nodes_[number].box = box_around(nodes_[number]);
  for (number = nodes_[number].parent; number >= 0; number = nodes_[number].parent) {
    const Box box = box_around(nodes_[number]);
    if (box.low == nodes_[number].box.low && box.high == nodes_[number].box.high) return;
    nodes_[number].box = box;
  }
}

TriangleTree tree_of_points(const std::vector<Vec3>& points) {
  Surface flat{"points", points, {}};
  for (const int64_t p : base::all_rows(points.size())) flat.triangles.push_back({p, p, p});
  return TriangleTree(flat);
}

}  // namespace repose::surface
