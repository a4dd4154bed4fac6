#include <Eigen/LU>
#include <algorithm>

#include "repose/imaging/volume_filter.h"

namespace repose::imaging {
namespace {

using Offset = std::array<int64_t, 3>;

/// The voxels whose centers lie within `radius` mm of that of voxel (0, 0, 0), but itself.
std::vector<Offset> ball(const Mat3& axes, double radius) {
  const Mat3 inverse = axes.inverse();
  std::array<int64_t, 3> reach;
  for (int axis = 0; axis < 3; ++axis)
    reach[axis] = static_cast<int64_t>(radius * inverse.row(axis).norm());
  std::vector<Offset> offsets;
  for (int64_t k = -reach[2]; k <= reach[2]; ++k)
    for (int64_t j = -reach[1]; j <= reach[1]; ++j)
      for (int64_t i = -reach[0]; i <= reach[0]; ++i) {
        const Vec3 step(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        const bool itself = i == 0 && j == 0 && k == 0;
        if (!itself && (axes * step).norm() <= radius) offsets.push_back({i, j, k});
      }
  return offsets;
}

/// For each voxel the extreme over the ball around it, as far as it lies in the volume.
template <class Extreme>
std::vector<float> extremes(const Volume& volume, const std::vector<Offset>& offsets,
                            Extreme extreme, const Watch& watch) {
  std::vector<float> result = volume.values;
  const auto [columns, rows, slices] = volume.size;
  for (int64_t k = 0; k < slices; ++k) {
    for (const auto& [di, dj, dk] : offsets) {
      if (k + dk < 0 || k + dk >= slices) continue;
      for (int64_t j = std::max(int64_t{0}, -dj); j < std::min(rows, rows - dj); ++j) {
        float* target = &result[volume.index(0, j, k)];
        const float* source = &volume.values[volume.index(0, j + dj, k + dk)];
        const int64_t begin = std::max(int64_t{0}, -di), end = std::min(columns, columns - di);
        for (int64_t i = begin; i < end; ++i) target[i] = extreme(target[i], source[i + di]);
      }
    }
    if (watch) watch(static_cast<double>(k + 1) / static_cast<double>(slices));
  }
  return result;
}

}  // namespace

Volume close_gaps(const Volume& volume, double radius, const Watch& watch) {
  const auto offsets = ball(volume.axes, radius);
  const auto part = [&](double begin) {
    return watch ? Watch([&watch, begin](double done) { watch(begin + done / 2); }) : Watch();
  };
  Volume grown = volume;
  grown.values = extremes(
      volume, offsets, [](float a, float b) { return a < b ? b : a; }, part(0));
  Volume closed = volume;
  closed.values = extremes(
      grown, offsets, [](float a, float b) { return b < a ? b : a; }, part(0.5));
  return closed;
}

}  // namespace repose::imaging
