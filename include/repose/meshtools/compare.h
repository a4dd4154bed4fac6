#pragma once
#include <string>
#include <vector>

#include "repose/imaging/volume.h"
#include "repose/surface/distance.h"

/// How far one surface lies from another.
namespace repose::meshtools {

using imaging::Watch;
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
  std::vector<bool> vertex_on_border_;             ///< [P]
};

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
  double area = 0;                                        ///< mm²
  double mean_signed = 0, mean = 0, rms = 0;              ///< mm
  double median = 0;                                      ///< mm
  double percentile_90 = 0, percentile_95 = 0, most = 0;  ///< mm
  double within_1 = 0, within_2 = 0;  ///< share of the area with |distance| of at most 1, 2 mm
};

/// Of no samples: zeros.
DistanceStatistics statistics(const std::vector<Sample>& samples);

/// A colour map for distances from −reach (blue) over 0 (white) to +reach (red), mm.
std::array<uint8_t, 3> distance_colour(double distance, double reach);

}  // namespace repose::meshtools
