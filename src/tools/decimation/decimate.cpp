#include "repose/tools/decimation/decimate.h"

#include <algorithm>
#include <cmath>

#include "collapse.h"
#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"

namespace repose::tools::decimation {
using namespace surface;
namespace {

/// Shares of the distance: kept free while collapsing, so that the last proof, which is this
/// accurate, ends below the distance requested.
constexpr double proof_accuracy = 5e-4;
/// The distances of a result without a bound are known to this share of the input's extent.
constexpr double measure_accuracy = 1e-5;
/// Least distance that is proven, as a share of the input's extent.
constexpr double least_share = 1e-9;
/// First and last tolerance on the way to a count, as shares of the input's extent.
constexpr double first_share = 5e-4, last_share = 0.1;

int64_t nearest_vertex(const Surface& surface, const Vec3& point) {
  const auto squared = [&](const Vec3& p) { return (p - point).squaredNorm(); };
  return std::ranges::min_element(surface.points, {}, squared) - surface.points.begin();
}

void check_intersections(const Surface& result, const Surface& input) {
  const size_t pairs = self_intersections(result).size();
  if (pairs > 0 && self_intersections(input).empty())
    throw base::InternalError(
        fmt::format("{}: decimation made {} pairs of triangles intersect", input.name, pairs));
}

void measure(Decimated& decimated, const Surface& input, double distance) {
  const double extent = bounding_diagonal(input.points);
  const bool bounded = std::isfinite(distance);
  const double fine = std::max(measure_accuracy * extent, 1e-300),
               coarse = bounded ? 10 * fine : fine;
  decimated.to_input =
      one_sided_distance(decimated.surface, input, std::min(proof_accuracy * distance, coarse));
  decimated.from_input =
      one_sided_distance(input, decimated.surface, std::clamp(0.01 * distance, fine, coarse));
  if (!(decimated.to_input.upper <= distance))
    throw base::InternalError(fmt::format("{}: distance {} mm could not be proven, only {} mm",
                                          input.name, distance, decimated.to_input.upper));
}

/// For a count alone the tolerance widens step by step, so that the distance stays small: the least
/// quadric error first says little about the worst point.
void collapse(Collapser& collapser, const Surface& surface, const DecimateOptions& options,
              const std::function<void(int64_t)>& report) {
  const TriangleTree tree(surface);
  const double extent = bounding_diagonal(surface.points);
  const auto run = [&](const Tolerance* tolerance) {
    collapser.run(options.triangles, tolerance, [&] { report(collapser.triangles()); });
  };
  if (std::isfinite(options.distance)) {
    const Tolerance tolerance(tree, (1 - proof_accuracy) * options.distance, extent);
    return run(&tolerance);
  }
  double distance = first_share * extent;
  while (distance < last_share * extent) {
    if (collapser.triangles() <= options.triangles) return;
    const Tolerance tolerance(tree, distance, extent);
    run(&tolerance);
    distance *= 2;
  }
  run(nullptr);
}

}  // namespace

Decimated decimate(const Surface& surface, const DecimateOptions& options,
                   const std::function<void(int64_t)>& report) {
  const double least = least_share * bounding_diagonal(surface.points);
  if (options.distance < least)
    base::refuse(
        "{}: -distance must be {:.1g} mm or more, to which distances in a mesh this large are "
        "known; it is {} mm",
        surface.name, least, options.distance);
  Decimated decimated;
  std::vector<char> locked = border_vertices(EdgeTable(surface.triangles), surface.points.size());
  for (const Vec3& landmark : options.landmarks) {
    const int64_t vertex = nearest_vertex(surface, landmark);
    locked[vertex] = true;
    decimated.landmark_distance.push_back((surface.points[vertex] - landmark).norm());
  }
  Collapser collapser(surface, locked);
  collapse(collapser, surface, options, report);
  decimated.surface = collapser.result();
  check_intersections(decimated.surface, surface);
  measure(decimated, surface, options.distance);
  return decimated;
}

}  // namespace repose::tools::decimation
