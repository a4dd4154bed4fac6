#pragma once
#include <array>
#include <vector>

#include "repose/surface/distance.h"

namespace repose::meshtools {

using surface::DistanceTree;
using surface::Surface;

/// The signed distance of points to a surface: positive where its triangles face. The sign is that
/// of the angle-weighted pseudonormal at the nearest point, which is right on edges and corners too
/// (Bærentzen and Aanæs, "Signed Distance Computation Using the Angle Weighted Pseudonormal",
/// 2005).
class SignedDistance {
 public:
  /// Throws InputError for a surface without a triangle that has an area.
  explicit SignedDistance(const Surface& surface);

  struct Answer {
    double distance;  ///< mm, signed
    bool beyond_rim;  ///< the nearest point lies on a border of the surface
  };
  /// Returns the signed distance of a point, mm.
  Answer at(const Vec3& point) const;

 private:
  struct Feature {
    Vec3 normal;
    bool border;
  };
  Feature feature_at(const DistanceTree::Nearest& nearest) const;

  const Surface& surface_;
  DistanceTree tree_;
  std::vector<Vec3> face_normal_, vertex_normal_;  ///< [T], [P]
  std::vector<std::array<Feature, 3>> side_;       ///< [T] from corner k to the next
  std::vector<char> vertex_on_border_;             ///< [P]
};

}  // namespace repose::meshtools
