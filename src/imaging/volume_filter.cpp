#include "repose/imaging/volume_filter.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/base/error.h"

namespace repose::imaging {

std::array<float, 2> value_range(const Volume& volume) {
  float minimum = std::numeric_limits<float>::infinity(), greatest = -minimum;
  for (const float value : volume.values) {
    if (value == beyond_volume) continue;
    minimum = std::min(minimum, value);
    greatest = std::max(greatest, value);
  }
  return {minimum, greatest};
}

std::string describe_values(const Volume& volume) {
  const auto [minimum, greatest] = value_range(volume);
  const bool narrow = minimum >= -128 && greatest <= 255;
  return fmt::format(
      "its values go from {:g} to {:g}{}", minimum, greatest,
      narrow
          ? ", as 8 bits hold them; a CT in Hounsfield units, from -1000 in air to 1000 and more "
            "in bone, needs 16: export it again"
          : "");
}

double otsu_level(const Volume& volume) {
  constexpr int bins = 1024;
  const auto [minimum, greatest] = value_range(volume);
  if (minimum == greatest)
    base::refuse("{}: every value is {:g}, so no level parts them; check the volume", volume.name,
                 minimum);
  const double width = (static_cast<double>(greatest) - minimum) / bins;
  std::array<double, bins> count{};
  for (const float value : volume.values)
    if (value != beyond_volume)
      ++count[std::min(bins - 1, static_cast<int>((value - minimum) / width))];
  double all = 0, moment = 0, below = 0, moment_below = 0, maximum = -1;
  int split = 0;
  for (int b = 0; b < bins; ++b) {
    all += count[b];
    moment += b * count[b];
  }
  for (int b = 0; b + 1 < bins; ++b) {
    below += count[b];
    moment_below += b * count[b];
    if (below == 0 || below == all) continue;
    const double apart = moment_below / below - (moment - moment_below) / (all - below);
    const double between = below * (all - below) * apart * apart;
    if (between <= maximum) continue;
    maximum = between;
    split = b;
  }
  return minimum + (split + 1) * width;
}

Volume block(const Volume& volume, const std::array<int64_t, 3>& begin,
             const std::array<int64_t, 3>& end) {
  Volume part{volume.name, {}, volume.axes, volume.origin, {}, volume.remarks};
  for (int axis = 0; axis < 3; ++axis) {
    part.size[axis] = end[axis] - begin[axis];
    part.origin += static_cast<double>(begin[axis]) * volume.axes.col(axis);
  }
  for (int64_t k = begin[2]; k < end[2]; ++k)
    for (int64_t j = begin[1]; j < end[1]; ++j) {
      const float* row = &volume.values[volume.index(0, j, k)];
      part.values.insert(part.values.end(), row + begin[0], row + end[0]);
    }
  return part;
}

namespace {

[[noreturn]] void refuse_beside(const Volume& volume, const Vec3& low, const Vec3& high) {
  base::refuse("{}: the box {:g} to {:g} mm lies beside it", volume.name, low, high);
}

}  // namespace

Volume crop(const Volume& volume, const Vec3& low, const Vec3& high) {
  const Mat3 to_index = volume.axes.inverse();
  Vec3 first = Vec3::Constant(std::numeric_limits<double>::infinity()), last = -first;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = corner >> axis & 1 ? high[axis] : low[axis];
    const Vec3 index = to_index * (point - volume.origin);
    first = first.cwiseMin(index);
    last = last.cwiseMax(index);
  }
  std::array<int64_t, 3> begin, end;
  for (int axis = 0; axis < 3; ++axis) {
    const auto maximum = static_cast<double>(volume.size[axis] - 1);
    begin[axis] = static_cast<int64_t>(std::clamp(std::floor(first[axis] + 1e-6), 0.0, maximum));
    end[axis] = static_cast<int64_t>(std::clamp(std::ceil(last[axis] - 1e-6), 0.0, maximum)) + 1;
    if (end[axis] - begin[axis] < 2) refuse_beside(volume, low, high);
  }
  return block(volume, begin, end);
}

int64_t leave_out(const Vec3& low, const Vec3& high, Volume& volume) {
  constexpr double straight = 1e-3;  // of a step, that it may stray from x, y or z
  const Mat3 steps = volume.axes.cwiseAbs();
  Vec3 margin;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = steps.row(axis).maxCoeff();
    const bool oblique = steps.row(axis).sum() > (1 + straight) * along;
    margin[axis] = oblique ? straight * along : std::numeric_limits<double>::infinity();
  }
  int64_t count = 0;
  for (size_t v = 0; v < volume.values.size(); ++v) {
    const Vec3 center = volume.center(static_cast<int64_t>(v));
    if ((center.array() >= (low - margin).array()).all() &&
        (center.array() <= (high + margin).array()).all())
      continue;
    volume.values[v] = beyond_volume;
    ++count;
  }
  if (count == std::ssize(volume.values)) refuse_beside(volume, low, high);
  return count;
}

}  // namespace repose::imaging
