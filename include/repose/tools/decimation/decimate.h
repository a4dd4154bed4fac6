#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "repose/tools/decimation/hausdorff.h"

namespace repose::tools::decimation {

using surface::Surface;

struct DecimateOptions {
  /// Largest one-sided Hausdorff distance of the result to the input, mm; ∞: no bound.
  double distance = std::numeric_limits<double>::infinity();
  /// Stop when this many are left. Without a distance the tolerance widens step by step until then,
  /// so that the count costs little distance.
  int64_t triangles = 0;
  std::vector<Vec3> landmarks = {};  ///< the vertex nearest to each stays where it is, mm
};

struct Decimated {
  Surface surface;
  DistanceBounds to_input;    ///< of the result to the input: what the bound is about
  DistanceBounds from_input;  ///< of the input to the result: what was left out; not bounded
  std::vector<double> landmark_distance;  ///< of each landmark to the vertex kept for it, mm
};

/// Fewest triangles that edge collapse finds within the bounds of `options`, for a manifold
/// surface (load_surface, Role::mesh). Every step keeps the topology, is proven to stay within the
/// distance of the input (tolerance.h), and makes no triangle meet another, so that the result is
/// manifold, and free of self-intersections where the input is. Border vertices and the vertices
/// at landmarks stay. The distance is then proven again for the result as a whole, by branch and
/// bound that shares only the tree with the first proof; where that fails, or the result
/// intersects itself and the input did not, InternalError.
///
/// The bound is one-sided, as asked: a spike or a plate thinner than twice the distance may be
/// drawn in, for all of the result still lies near the input; from_input tells how far.
///
/// `report` is called now and then with the number of triangles left.
Decimated decimate(const Surface& surface, const DecimateOptions& options,
                   const std::function<void(int64_t)>& report);

}  // namespace repose::tools::decimation
