#pragma once
#include <vector>

#include "repose/imaging/volume.h"
#include "repose/meshtools/signed_distance.h"

/// Distances between two surfaces.
namespace repose::tools::comparison {

using imaging::Watch;
using meshtools::SignedDistance;
using surface::Surface;

/// One place of a surface with the area it stands for and its distance to another surface.
struct Sample {
  Vec3 point;       ///< mm
  double area;      ///< mm²
  double distance;  ///< mm, signed
  bool beyond_rim;
};

/// Distances from `from` to `to` at the middles of equal parts of its triangles, no part with a
/// side longer than `spacing` mm. So statistics do not depend on how finely either is meshed.
std::vector<Sample> sample_distances(const Surface& from, const SignedDistance& to, double spacing,
                                     const Watch& watch = {});

/// All weighted by area; the percentiles and `most` of |distance|.
struct DistanceStatistics {
  int64_t samples = 0;
  double area = 0;                                           ///< mm²
  double mean_signed = 0, mean = 0, rms = 0;                 ///< mm
  double median = 0;                                         ///< mm
  double percentile_90 = 0, percentile_95 = 0, maximum = 0;  ///< mm
  double within_1 = 0, within_2 = 0;  ///< share of the area with |distance| of at most 1, 2 mm
};

/// Returns the statistics of samples; zeros without samples.
DistanceStatistics statistics(const std::vector<Sample>& samples);

/// A color map for distances from −reach (blue) over 0 (white) to +reach (red), mm.
std::array<uint8_t, 3> distance_color(double distance, double reach);

}  // namespace repose::tools::comparison
