#pragma once
#include <functional>
#include <set>

#include "repose/imaging/volume.h"
#include "repose/surface/surface.h"

/// Volumes with known surfaces, and what is counted on a surface.
namespace repose::imaging {

using surface::Surface;

/// A volume of n³ voxels around the origin whose values are those of `value` at their centers.
inline Volume sampled(int64_t n, const Mat3& axes,
                      const std::function<double(const Vec3&)>& value) {
  Volume volume{"sampled", {n, n, n}, axes, {}, {}, {}};
  volume.origin = -axes * Vec3::Constant(static_cast<double>(n - 1) / 2);
  for (int64_t k = 0; k < n; ++k)
    for (int64_t j = 0; j < n; ++j)
      for (int64_t i = 0; i < n; ++i) {
        const Vec3 index(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        volume.values.push_back(static_cast<float>(value(volume.origin + axes * index)));
      }
  return volume;
}

/// V − E + F.
inline int64_t euler_characteristic(const Surface& surface) {
  std::set<std::pair<int64_t, int64_t>> edges;
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  return static_cast<int64_t>(surface.points.size()) - static_cast<int64_t>(edges.size()) +
         static_cast<int64_t>(surface.triangles.size());
}

}  // namespace repose::imaging
