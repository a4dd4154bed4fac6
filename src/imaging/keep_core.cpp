#include <cmath>

#include "repose/base/error.h"
#include "repose/imaging/volume_filter.h"

namespace repose::imaging {
namespace {

using Mask = std::vector<char>;

/// The largest set of voxels at or above the level that share faces.
Mask largest_part(const Volume& volume, double level) {
  Mask seen(volume.values.size(), 0);
  std::vector<int64_t> largest, part;
  const auto add = [&](int64_t voxel) {
    if (seen[voxel] || volume.values[voxel] < level) return;
    seen[voxel] = 1;
    part.push_back(voxel);
  };
  for (int64_t first = 0; first < std::ssize(seen); ++first) {
    part.clear();
    add(first);
    for (size_t next = 0; next < part.size(); ++next) volume.visit_neighbors(part[next], add);
    if (part.size() > largest.size()) largest.swap(part);
  }
  Mask mask(seen.size(), 0);
  for (const int64_t voxel : largest) mask[voxel] = 1;
  return mask;
}

/// Adds the voxels within `reach` voxels before and behind along one axis.
void widen(const Volume& volume, int axis, int64_t reach, Mask& mask) {
  const std::array<int64_t, 3> step{1, volume.size[0], volume.size[0] * volume.size[1]};
  const Mask old = mask;
  const auto pass = [&](int64_t first, int64_t stride) {
    int64_t left = 0;
    for (int64_t n = 0, voxel = first; n < volume.size[axis]; ++n, voxel += stride) {
      if (old[voxel])
        left = reach;
      else if (left-- > 0)
        mask[voxel] = 1;
    }
  };
  for (int64_t voxel = 0; voxel < std::ssize(mask); ++voxel) {
    if (voxel / step[axis] % volume.size[axis] != 0) continue;
    pass(voxel, step[axis]);
    pass(voxel + (volume.size[axis] - 1) * step[axis], -step[axis]);
  }
}

}  // namespace

Volume keep_core(const Volume& volume, double core, double reach) {
  const auto [least, greatest] = value_range(volume);
  if (core > greatest)
    base::refuse("{}: no value is at or above that of the core, {:g}: {}", volume.name, core,
                 describe_values(volume));
  Mask kept = largest_part(volume, core);
  for (int axis = 0; axis < 3; ++axis)
    widen(volume, axis, std::lround(reach / volume.spacing(axis)), kept);
  Volume result = volume;
  for (size_t voxel = 0; voxel < kept.size(); ++voxel)
    if (!kept[voxel]) result.values[voxel] = least;
  return result;
}

}  // namespace repose::imaging
