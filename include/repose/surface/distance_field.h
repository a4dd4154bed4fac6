#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "repose/surface/surface.h"

namespace repose::surface {

/// A distance, mm, with its first two derivatives.
struct Distance {
  double value;
  Vec3 gradient;
  Mat3 curvature;  ///< 1/mm
};

/// The signed distance from a closed surface, negative inside, as a cubic B-spline on a grid of
/// cubes, so that two derivatives are continuous. The exact distances at the grid's points are its
/// coefficients, which smooths it by a Gaussian of 0.58 spacings (variance h²/3): plane parts stay
/// exact, a convex edge lies up to 0.3 spacings deeper than the surface's. Known inside the surface
/// and up to `reach` outside it. Plain arrays: blocks of 8³ values where it is known.
class DistanceField {
 public:
  static constexpr int block = 8;

  DistanceField() = default;
  /// From exact distances to the closest triangle, found near the surface and handed on from grid
  /// point to grid point. The sign is that of the angle-weighted pseudonormal there (Bærentzen &
  /// Aanæs 2005, "Signed distance computation using the angle weighted pseudonormal"), put to the
  /// vote among grid points between which no surface can lie, because slivers mislead some. Left
  /// out where a block is not `wanted`, if any is; −`near` mm at least, or −`reach`. `spacing` and
  /// `reach` in mm. O(T + grid points).
  DistanceField(const Surface& surface, double spacing, double reach,
                const std::vector<char>& wanted, double near);
  /// [blocks] 1: a block of that field's grid that is nowhere farther than `near` from a point.
  static std::vector<char> blocks_near(const Surface& surface, double spacing, double reach,
                                       const std::vector<Vec3>& points, double near);

  /// The value alone, mm; `reach` where the field is not known.
  double value(const Vec3& point) const;
  /// With derivatives; these are 0 where the field is not known.
  Distance sample(const Vec3& point) const;
  double reach() const { return reach_; }

  /// Its arrays, for those who send it elsewhere.
  template <class Archive>
  void pass(Archive& archive) {
    archive(origin_, spacing_, reach_, depth_, size_, place_, value_);
  }

 private:
  friend class FieldBuilder;
  struct Corner;
  void lay_grid(const Surface& surface);
  bool locate(const Vec3& point, Corner& corner) const;

  Vec3 origin_ = Vec3::Zero();                  // mm, of grid point (0, 0, 0)
  double spacing_ = 1, reach_ = 0, depth_ = 0;  // mm
  std::array<int32_t, 3> size_{};               // blocks along each axis
  std::vector<int32_t> place_;                  // [blocks] which of the kept ones, or −1
  std::vector<float> value_;                    // [kept blocks][8³] mm
};

}  // namespace repose::surface
