#include "repose/tools/comparison/compare.h"

#include <algorithm>
#include <cmath>

#include "repose/surface/component.h"

namespace repose::tools::comparison {
using namespace surface;
using namespace imaging;
namespace {

using Absolute = std::vector<std::pair<double, double>>;  // |distance|, area; ascending

/// Least distance within which `area` lies.
double distance_of_area(const Absolute& sorted, double area) {
  double sum = 0;
  for (const auto& [distance, part] : sorted)
    if ((sum += part) >= area) return distance;
  return sorted.back().first;
}

double area_within(const Absolute& sorted, double limit) {
  double sum = 0;
  for (const auto& [distance, part] : sorted)
    if (distance <= limit) sum += part;
  return sum;
}

}  // namespace

std::vector<Sample> sample_distances(const Surface& from, const SignedDistance& to, double spacing,
                                     const Watch& watch) {
  const Samples points = sample(from, spacing);
  const size_t count = points.point.size();
  std::vector<Sample> samples;
  for (size_t s = 0; s < count; ++s) {
    const auto answer = to.at(points.point[s]);
    samples.push_back({points.point[s], points.area[s], answer.distance, answer.beyond_rim});
    if (watch && s % 1024 == 0) watch(static_cast<double>(s) / static_cast<double>(count));
  }
  return samples;
}

DistanceStatistics statistics(const std::vector<Sample>& samples) {
  DistanceStatistics result;
  Absolute sorted;
  for (const Sample& sample : samples) {
    const double distance = std::abs(sample.distance);
    sorted.emplace_back(distance, sample.area);
    result.area += sample.area;
    result.mean_signed += sample.area * sample.distance;
    result.mean += sample.area * distance;
    result.rms += sample.area * distance * distance;
    result.maximum = std::max(result.maximum, distance);
  }
  result.samples = std::ssize(samples);
  if (!(result.area > 0)) return {};
  result.mean_signed /= result.area;
  result.mean /= result.area;
  result.rms = std::sqrt(result.rms / result.area);
  std::sort(sorted.begin(), sorted.end());
  result.within_1 = area_within(sorted, 1) / result.area;
  result.within_2 = area_within(sorted, 2) / result.area;
  result.median = distance_of_area(sorted, 0.50 * result.area);
  result.percentile_90 = distance_of_area(sorted, 0.90 * result.area);
  result.percentile_95 = distance_of_area(sorted, 0.95 * result.area);
  return result;
}

std::array<uint8_t, 3> distance_color(double distance, double reach) {
  const double share = std::clamp(distance / reach, -1.0, 1.0);
  const auto fade = [&](double end) {
    return static_cast<uint8_t>(std::lround(255 * (1 - std::abs(share) * (1 - end))));
  };
  return share < 0 ? std::array<uint8_t, 3>{fade(0.13), fade(0.30), fade(0.75)}
                   : std::array<uint8_t, 3>{fade(0.75), fade(0.13), fade(0.16)};
}

}  // namespace repose::tools::comparison
