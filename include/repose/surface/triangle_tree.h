#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "repose/surface/surface.h"

namespace repose::surface {

using Corners = std::array<Vec3, 3>;  ///< of a triangle, mm

inline Corners corners(const Surface& surface, const Triangle& triangle) {
  return base::pick(surface.points, triangle);
}

/// Weights of a triangle's corners at the foot of a point in its plane; their sum is 1.
Vec3 barycentric(const Corners& triangle, const Vec3& point);

/// Normal of a triangle whose length is twice the area, mm².
Vec3 scaled_normal(const Corners& triangle);

/// k such that no edge is longer than that from corner k to the next.
int longest_edge(const Corners& triangle);
double longest_side(const Corners& triangle);  ///< mm

/// The square of the distance from `query` to a point of the triangle that is, up to rounding, its
/// closest (Ericson, Real-Time Collision Detection, 5.1.5). Where a thin triangle spoils the
/// choice the point is still one of the triangle: never less than the true distance, up to 1e-13
/// of the coordinates. `closest` receives the point.
double squared_distance(const Vec3& query, const Corners& triangle, Vec3* closest = nullptr);

/// Triangles in a tree of boxes, in doubles and with early exits: for loops that ask one surface
/// millions of questions, where DistanceTree's exact arithmetic is not needed. Build O(T log T).
/// Triangles may be exchanged one by one later, which only refits boxes.
class TriangleTree {
 public:
  struct Box {
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
    Vec3 high = Vec3::Constant(-std::numeric_limits<double>::infinity());
    void extend(const Vec3& point) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    void extend(const Box& box) {
      low = low.cwiseMin(box.low);
      high = high.cwiseMax(box.high);
    }
    bool overlaps(const Box& box) const;
    /// mm², 0 inside; ∞ to the empty box.
    double squared_distance(const Vec3& point) const {
      return (low - point).cwiseMax(point - high).cwiseMax(0.0).squaredNorm();
    }
  };
  struct Nearest {
    double squared = std::numeric_limits<double>::infinity();  ///< mm²
    int64_t triangle = -1;
    Vec3 point = Vec3::Zero();
  };

  explicit TriangleTree(const Surface& surface);

  /// The closest point, if nearer than √limit. The triangle `hint` is tried first.
  Nearest nearest(const Vec3& query, double limit = std::numeric_limits<double>::infinity(),
                  int64_t hint = -1) const;

  /// A triangle within √limit of the point, −1 for none. `hint` is tried first.
  int64_t any_within(const Vec3& query, double limit, int64_t hint = -1) const;

  /// Returns the least of all triangles of the max over `points` of the squared distance to it;
  /// stops at the first one that is at most `enough`.
  double min_max(std::span<const Vec3> points, double enough) const;

  /// Returns whether all points lie within √limit of one and the same triangle. `hint` is tried
  /// first and receives that triangle.
  bool one_covers(std::span<const Vec3> points, double limit, int64_t& hint) const;

  /// Calls visit(triangle) for each triangle whose box `region` overlaps, until it returns true;
  /// whether one did. `region` is a Box, or another class with overlaps(const Box&).
  template <class Region, class Visit>
  bool overlapping(const Region& region, Visit&& visit) const {
    int64_t stack[max_depth], depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!region.overlaps(node.box)) continue;
      if (node.count == 0) {
        stack[depth++] = node.right;
        stack[depth++] = &node - nodes_.data() + 1;
      }
      for (int64_t i = node.first; i < node.first + node.count; ++i)
        if (region.overlaps(box_of(sorted_[i])) && visit(order_[i])) return true;
    }
    return false;
  }

  /// The triangle takes other corners, or none.
  void exchange(int64_t triangle, const Corners& corners);
  void remove(int64_t triangle);

  const Corners& corners_of(int64_t triangle) const { return sorted_[row_[triangle]]; }

  static Box box_of(const Corners& corners);

 private:
  static constexpr int max_depth = 128;
  struct Node {
    Box box;
    int64_t first = 0, count = 0;  ///< of a leaf, in order_
    int64_t right = -1;            ///< the left child follows its parent
    int64_t parent = -1;
  };

  int64_t build(int64_t first, int64_t end, int64_t parent, const std::vector<Vec3>& centers);
  template <class Key, class Allowed, class Visit>
  void walk(Key&& key, Allowed&& allowed, Visit&& visit) const;
  Box box_around(const Node& node) const;
  void refit(int64_t node);

  std::vector<int64_t> order_;    ///< triangles by leaf
  std::vector<Corners> sorted_;   ///< in this order
  std::vector<int64_t> row_;      ///< triangle → its row in this order
  std::vector<int64_t> leaf_of_;  ///< triangle → node
  std::vector<Node> nodes_;
};

/// Returns a tree that finds the nearest of many points: its triangles are these points.
TriangleTree tree_of_points(const std::vector<Vec3>& points);

}  // namespace repose::surface
