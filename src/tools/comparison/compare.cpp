#include "repose/tools/comparison/compare.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace repose::tools::comparison {
using namespace surface;
using namespace imaging;
namespace {

/// The middles of the n² equal parts of a triangle cut n times along each side.
template <class Visit>
void visit_parts(const Vec3& a, const Vec3& b, const Vec3& c, int64_t n, Visit visit) {
  const Vec3 u = (b - a) / static_cast<double>(n), v = (c - a) / static_cast<double>(n);
  for (int64_t i = 0; i < n; ++i)
    for (int64_t j = 0; i + j < n; ++j) {
      const auto x = static_cast<double>(i), y = static_cast<double>(j);
      visit(Vec3(a + (x + 1.0 / 3) * u + (y + 1.0 / 3) * v));
      if (i + j + 1 < n) visit(Vec3(a + (x + 2.0 / 3) * u + (y + 2.0 / 3) * v));
    }
}

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
  std::vector<Sample> samples;
  for (size_t t = 0; t < from.triangles.size(); ++t) {
    const auto& [p, q, r] = from.triangles[t];
    const Vec3 &a = from.points[p], &b = from.points[q], &c = from.points[r];
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const auto n = std::max(int64_t{1}, static_cast<int64_t>(std::ceil(longest / spacing)));
    const double area = (b - a).cross(c - a).norm() / 2 / static_cast<double>(n * n);
    visit_parts(a, b, c, n, [&](const Vec3& point) {
      const auto answer = to.at(point);
      samples.push_back({point, area, answer.distance, answer.beyond_rim});
    });
    if (watch && t % 1024 == 0)
      watch(static_cast<double>(t) / static_cast<double>(from.triangles.size()));
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
  result.samples = static_cast<int64_t>(samples.size());
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
