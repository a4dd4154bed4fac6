#pragma once
#include <array>
#include <cstdint>
#include <memory>

#include "repose/surface/surface.h"

namespace repose::surface {

/// A distance, mm, with its first two derivatives.
struct Distance {
  double value;
  Vec3 gradient;
  Mat3 curvature;  ///< 1/mm
};

/// The signed distance from a closed surface, negative inside, as a cubic B-spline on a grid of
/// cubes, so that two derivatives are continuous. Its coefficients are the exact distances at the
/// grid points, at most `reach`, less a sixth of their second differences: a quasi-interpolant
/// that reproduces cubics (de Boor 1978). Plane parts are exact; a convex edge of 90° lies 0.2
/// spacings deeper than the surface's. Inside is where the surface's winding number is not 0. Grid
/// values are computed when they are first needed and kept in memory. A value depends on its grid
/// point alone, so that neither the order of questions nor the rank matters. One thread at a time
/// may ask a field and its copies.
class DistanceField {
 public:
  using Index = std::array<int64_t, 3>;  ///< of a grid point

  DistanceField() = default;
  /// Lays the grid, without any value. `spacing` and `reach` in mm. Throws InputError where the
  /// grid would be too large.
  DistanceField(Surface surface, double spacing, double reach);

  /// The field of the same surface on a grid so many times coarser, with the distances themselves
  /// as coefficients, which smooths by a Gaussian of 0.58 spacings (variance h²/3).
  DistanceField rounded(double times) const;

  /// The value alone, mm; `reach` beyond.
  double value(const Vec3& point) const;
  /// With derivatives; these are 0 beyond `reach`.
  Distance sample(const Vec3& point) const;
  const Surface& surface() const { return surface_; }
  /// A lower bound of value(point), mm, that costs one exact distance or none: a rough one where it
  /// is at least `enough`.
  double lower_bound(const Vec3& point, double enough) const;
  /// Exact distance and direction from the surface to a point outside, in place of those of the
  /// spline: curvature 0; `reach` and a gradient of 0 beyond.
  Distance outside(const Vec3& point) const;

  Vec3 grid_point(const Index& at) const { return grid_.point(at); }  ///< mm
  Index grid_points() const;                                          ///< along each axis
  /// The exact signed distance at a grid point, at most `reach`, rounded to single precision.
  float value_at(const Index& at) const;
  int64_t computed_values() const;  ///< grid values that are known

 private:
  struct Grid {
    Vec3 origin = Vec3::Zero();     // mm, of grid point (0, 0, 0)
    double spacing = 1, reach = 0;  // mm
    Index blocks{};                 // along each axis
    bool rounded = false;           // coefficients are the values
    Vec3 point(const Index& at) const;
    Index nearest(const Vec3& point) const;
  };
  class Values;
  struct Stencil;
  Values& values() const;
  bool locate(const Vec3& point, Stencil& stencil) const;

  Surface surface_;
  Grid grid_;
  mutable std::shared_ptr<Values> values_;  // made by the first question
};

}  // namespace repose::surface
