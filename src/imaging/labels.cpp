#include <algorithm>
#include <cmath>
#include <set>

#include "repose/base/error.h"
#include "repose/imaging/volume_filter.h"

namespace repose::imaging {
namespace {

std::vector<float> gauss_weights(double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> weights;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    sum += weights.back();
  }
  for (float& weight : weights) weight /= sum;
  return weights;
}

/// One axis smoothed; beyond the border the outermost value is repeated.
void smooth_axis(Volume& volume, int axis, const std::vector<float>& weights) {
  int64_t inner = 1, outer = 1;
  for (int a = 0; a < axis; ++a) inner *= volume.size[a];
  for (int a = axis + 1; a < 3; ++a) outer *= volume.size[a];
  const int64_t count = volume.size[axis];
  const auto reach = static_cast<int64_t>(weights.size() / 2);
  std::vector<float> values(volume.values.size(), 0.0f);
  for (int64_t o = 0; o < outer; ++o)
    for (int64_t n = 0; n < count; ++n)
      for (int64_t w = -reach; w <= reach; ++w) {
        const int64_t from = std::clamp(n + w, int64_t{0}, count - 1);
        const float* source = &volume.values[(o * count + from) * inner];
        float* target = &values[(o * count + n) * inner];
        for (int64_t i = 0; i < inner; ++i) target[i] += weights[w + reach] * source[i];
      }
  volume.values = std::move(values);
}

/// Where a label lies, as a box of voxels grown by `margin`, in mm; nothing where it is nowhere.
Volume around(const Volume& labels, int64_t label, int64_t margin) {
  std::array<int64_t, 3> low = labels.size, high{0, 0, 0};
  for (int64_t voxel = 0; voxel < std::ssize(labels.values); ++voxel) {
    if (labels.values[voxel] != static_cast<float>(label)) continue;
    const auto here = labels.index_of(voxel);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], here[axis]);
      high[axis] = std::max(high[axis], here[axis] + 1);
    }
  }
  if (high[0] == 0)
    base::refuse("{}: no voxel has the label {}; it has {}", labels.name, label,
                 fmt::join(labels_of(labels), ", "));
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::max(int64_t{0}, low[axis] - margin);
    high[axis] = std::min(labels.size[axis], high[axis] + margin);
  }
  return block(labels, low, high);
}

Volume smooth_indicator(const Volume& labels, float label, double sigma) {
  Volume field = labels;
  for (float& value : field.values) value = value == label ? 1.0f : 0.0f;
  for (int axis = 0; axis < 3; ++axis) smooth_axis(field, axis, gauss_weights(sigma));
  return field;
}

}  // namespace

std::vector<int64_t> labels_of(const Volume& volume) {
  constexpr size_t maximum = 1000;
  std::set<float> found;
  float last = -1;
  for (const float value : volume.values) {
    if (value == last) continue;
    last = value;
    if (value < 0 || value != std::floor(value))
      base::refuse("{}: holds {:g}; a label map holds whole numbers, 0 where nothing is",
                   volume.name, value);
    if (found.insert(value).second && found.size() > maximum)
      base::refuse("{}: holds more than {} different numbers; a label map is needed, not a CT",
                   volume.name, maximum);
  }
  found.erase(0.0f);
  return {found.begin(), found.end()};
}

Volume label_field(const Volume& labels, int64_t label, double sigma) {
  const Volume part = around(labels, label, static_cast<int64_t>(std::ceil(3 * sigma)) + 1);
  Volume field = smooth_indicator(part, static_cast<float>(label), sigma);
  std::vector<float> rival(field.values.size(), 0.0f);
  const std::set<float> present(part.values.begin(), part.values.end());
  for (const float other : present) {
    if (other == static_cast<float>(label)) continue;
    const Volume indicator = smooth_indicator(part, other, sigma);
    for (size_t v = 0; v < rival.size(); ++v) rival[v] = std::max(rival[v], indicator.values[v]);
  }
  for (size_t v = 0; v < rival.size(); ++v) field.values[v] -= rival[v];
  return field;
}

}  // namespace repose::imaging
