#include <algorithm>
#include <cmath>

#include "repose/imaging/volume_filter.h"

namespace repose::imaging {
namespace {

/// A new voxel as the old ones it covers and how much of each.
struct Share {
  int64_t from;
  double weight;
};

std::vector<std::vector<Share>> shares(int64_t old_count, int64_t new_count) {
  std::vector<std::vector<Share>> rows(new_count);
  const double width = static_cast<double>(old_count) / static_cast<double>(new_count);
  for (int64_t n = 0; n < new_count; ++n) {
    const double begin = static_cast<double>(n) * width, end = begin + width;
    for (auto o = static_cast<int64_t>(begin); o < old_count && static_cast<double>(o) < end; ++o) {
      const auto low = static_cast<double>(o);
      rows[n].push_back({o, (std::min(end, low + 1) - std::max(begin, low)) / width});
    }
  }
  return rows;
}

/// One axis made coarser: values [outer][axis][inner].
void coarsen_axis(Volume& volume, int axis, int64_t count) {
  int64_t inner = 1, outer = 1;
  for (int a = 0; a < axis; ++a) inner *= volume.size[a];
  for (int a = axis + 1; a < 3; ++a) outer *= volume.size[a];
  const int64_t old_count = volume.size[axis];
  const auto rows = shares(old_count, count);
  std::vector<float> values(static_cast<size_t>(inner * count * outer), 0.0f);
  for (int64_t o = 0; o < outer; ++o)
    for (int64_t n = 0; n < count; ++n) {
      float* target = &values[(o * count + n) * inner];
      for (const Share& share : rows[n]) {
        const float* source = &volume.values[(o * old_count + share.from) * inner];
        for (int64_t i = 0; i < inner; ++i)
          target[i] += static_cast<float>(share.weight) * source[i];
      }
    }
  const double ratio = static_cast<double>(old_count) / static_cast<double>(count);
  volume.origin += (ratio - 1) / 2 * volume.axes.col(axis);
  volume.axes.col(axis) *= ratio;
  volume.size[axis] = count;
  volume.values = std::move(values);
}

}  // namespace

Volume coarsen(const Volume& volume, double spacing) {
  Volume result = volume;
  for (int axis = 2; axis >= 0; --axis) {
    const double length = static_cast<double>(volume.size[axis]) * volume.spacing(axis);
    const auto count = std::max(int64_t{2}, static_cast<int64_t>(std::llround(length / spacing)));
    if (count < volume.size[axis]) coarsen_axis(result, axis, count);
  }
  return result;
}

}  // namespace repose::imaging
