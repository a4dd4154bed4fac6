#pragma once

#include "piece.h"
#include "repose/surface/triangle_tree.h"

namespace repose::tools::decimation {

using surface::TriangleTree;

/// The points within a distance of a surface, and proofs that triangles lie among them.
///
/// The distance to one triangle T is a convex function of the point, so over a convex piece s it is
/// greatest at a corner of s:  max_{p∈s} d(p, T) = max_i d(s_i, T).  Where one T of the surface is
/// within the distance of all corners of s, so is the surface of all of s; where none is, s is cut
/// along the edges of the T nearest to its center. This is exact but for rounding, for which 1e-9
/// of the surface's extent is kept free; no layer of prisms or samples stands for the surface, so
/// none of the distance is lost to them.
class Tolerance {
 public:
  Tolerance(const TriangleTree& tree, double distance, double extent);

  double distance() const { return distance_; }  ///< mm, what is kept free taken off

  /// Returns whether all of the triangle is proven to lie within the distance. If not, `outside` is
  /// a point of it that does not, or the middle of a piece for which that could not be decided.
  bool contains(const Corners& triangle, Vec3* outside) const;
  bool contains(const Vec3& point) const;
  /// The point of the surface closest to `point`.
  Vec3 nearest(const Vec3& point) const { return tree_.nearest(point).point; }

 private:
  const TriangleTree& tree_;
  double distance_, squared_;
  mutable int64_t hint_ = -1;
  mutable std::vector<Piece> pieces_;
};

}  // namespace repose::tools::decimation
