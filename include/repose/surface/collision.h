#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "repose/surface/surface.h"

/// Contacts between two surfaces that move rigidly: trees built once, queried in any pose.
namespace repose::surface {

/// Surfaces nearer than this touch, mm: far more than what rounding does to coordinates of bones,
/// so that no contact is missed.
constexpr double contact_margin = 1e-6;

/// A constant rigid velocity per unit of load: a point at x moves by angular × x + linear (mm).
struct Twist {
  Vec3 angular = Vec3::Zero(), linear = Vec3::Zero();
};

/// A hierarchy of boxes over the triangles of a surface. O(T log T) to build.
class CollisionTree {
 public:
  /// Throws InputError where a coordinate is not finite, an index has no point, or there is no
  /// triangle.
  explicit CollisionTree(const Surface& surface);

  /// A box around the triangles below it; `right` is its second child, the first follows it; a leaf
  /// (right < 0) holds one triangle.
  struct Node {
    Vec3 center, half;
    int64_t right, triangle;
  };
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::array<Vec3, 3>& corners(int64_t triangle) const { return corners_[triangle]; }
  int64_t triangles() const { return std::ssize(corners_); }

 private:
  void build(std::vector<int64_t>& rows, size_t begin, size_t end);

  std::vector<std::array<Vec3, 3>> corners_;  // [T]
  std::vector<Node> nodes_;                   // [2 T − 1], depth first
};

/// Two triangles and how far they are from each other.
struct ClosestApproach {
  double distance = std::numeric_limits<double>::infinity();  ///< mm, 0 where they intersect
  std::array<int64_t, 2> triangles{-1, -1};                   ///< of a and b
  Vec3 at = Vec3::Zero();  ///< mm, the middle of the shortest way between them, in a's frame
};

/// Returns whether the surfaces come within `margin` mm with `b` placed by `pose` (rigid) in the
/// frame of `a`. A surface that lies wholly inside the other does not touch it.
bool touch(const CollisionTree& a, const CollisionTree& b, const Mat4& pose,
           double margin = contact_margin);

/// The nearest triangles, no farther than `limit` mm apart.
std::optional<ClosestApproach> nearest(const CollisionTree& a, const CollisionTree& b,
                                       const Mat4& pose,
                                       double limit = std::numeric_limits<double>::infinity());

/// All pairs of triangles within `limit` mm, sorted.
std::vector<std::pair<int64_t, int64_t>> pairs_within(const CollisionTree& a,
                                                      const CollisionTree& b, const Mat4& pose,
                                                      double limit);

/// The triangles of a surface that lie within `near` mm of another, split until they are no longer
/// than `longest` mm or farther away; the others as they are. Points of neighbors are not shared.
Surface refine_near(const Surface& surface, const CollisionTree& own, const CollisionTree& other,
                    double near, double longest);

/// Two surfaces on their way: conservative advancement (Mirtich, 1996), each part of a surface with
/// a bound on its own speed.
class Encounter {
 public:
  /// Both at their initial positions, moving by constant twists in one frame (screw motions). Pairs
  /// of triangles that both lie within `touching` mm of the other surface there, or `inside` the
  /// other body ([2][triangles], may be empty), are ignored from then on: teeth that bite, the
  /// faces of a fresh cut. So those should be small (refine_near).
  Encounter(const CollisionTree& a, const CollisionTree& b, const Twist& twist_a,
            const Twist& twist_b, double touching,
            const std::array<std::vector<char>, 2>& inside = {});

  double ignored_area() const;  ///< mm², of both surfaces

  struct Next {
    double load;  ///< that may pass until some pair could be within `clearance`; infinite
    ClosestApproach approach;  ///< the pair that bounds it
  };
  /// From the relative pose of b in a's frame on.
  Next next(const Mat4& pose, double clearance);

 private:
  struct Side {
    const CollisionTree* tree;
    std::vector<double> speed;    // [nodes] mm per unit of load, at most
    std::vector<char> ignored;    // [triangles]
    std::vector<char> only_such;  // [nodes] all triangles below are ignored
  };
  static Side make_side(const CollisionTree& tree, const Twist& twist);
  static void summarize(Side& side);

  Side a_, b_;
  std::array<int64_t, 2> last_{-1, -1};  // the leaves that bounded the last question
};

}  // namespace repose::surface
