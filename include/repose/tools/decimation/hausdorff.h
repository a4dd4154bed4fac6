#pragma once
#include "repose/surface/surface.h"

namespace repose::tools::decimation {

using surface::Surface;

/// A distance enclosed between two numbers, mm.
struct DistanceBounds {
  double lower;  ///< reached at a point of the first surface, to rounding
  double upper;  ///< proven, rounding included
};

/// The one-sided Hausdorff distance max_{p∈from} min_{q∈to} |p − q| of triangle surfaces, each with
/// at least one triangle, enclosed to `accuracy` mm by branch and bound (as Tang, Lee and Kim,
/// Interactive Hausdorff distance computation for general polygonal models, 2009): for a convex
/// piece s of a triangle and any triangle T, max_{p∈s} d(p, T) is reached at a corner of s, for
/// d(·, T) is convex; the pieces with the greatest bounds are cut. Throws InternalError for an
/// empty surface.
DistanceBounds one_sided_distance(const Surface& from, const Surface& to, double accuracy);

}  // namespace repose::tools::decimation
