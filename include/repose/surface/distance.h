#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/surface/surface.h"

namespace repose::surface {

/// Answers distance and ray questions about one surface from a tree that is built once.
/// Construction O(T log T); each question O(log T). Const members may be called from any thread.
/// Triangles without area are left out. Throws InputError where none remains, InternalError for a
/// question about a point that is not finite.
class DistanceTree {
 public:
  explicit DistanceTree(const Surface& surface);
  ~DistanceTree();
  DistanceTree(DistanceTree&&) noexcept;
  DistanceTree& operator=(DistanceTree&&) noexcept;

  struct Nearest {
    Vec3 point;        ///< closest point on the surface, mm
    int64_t triangle;  ///< the triangle it lies on
    double distance;   ///< mm
  };
  /// Closest point of the surface to `query`.
  Nearest nearest(const Vec3& query) const;

  struct Hit {
    Vec3 point;  ///< mm
    int64_t triangle;
    double distance;  ///< along the ray, mm
  };
  /// First hit of the ray from `origin` along the unit vector `direction`, none within `reach` mm:
  /// nullopt. An origin on the surface is a hit at distance 0. Exact in whether there is a hit.
  std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction, double reach) const;

  /// Returns whether `query` is inside the (closed) surface or on it, by the parity of the
  /// triangles that a ray crosses, whatever their orientation; rays that touch an edge are not
  /// counted (exact).
  bool contains(const Vec3& query) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace repose::surface
