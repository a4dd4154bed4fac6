#include "lip_gap.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "movement.h"

namespace repose::app {
namespace {

constexpr double beside_stomion = 8;  // mm
constexpr double closed = 0.1;        // mm

using Pair = std::pair<size_t, size_t>;

/// The two points of the skin that one vertex became where the lips part, nearest to stomion.
std::optional<Pair> parted_vertex(const Vec3& stomion, const std::vector<Vec3>& points) {
  std::vector<size_t> near;
  for (size_t i = 0; i < points.size(); ++i)
    if ((points[i] - stomion).norm() < beside_stomion) near.push_back(i);
  std::ranges::stable_sort(near, {}, [&](size_t i) { return (points[i] - stomion).squaredNorm(); });
  for (size_t k = 0; k < near.size(); ++k)
    for (size_t l = k + 1; l < near.size(); ++l)
      if (points[near[k]] == points[near[l]]) return Pair(near[k], near[l]);
  return std::nullopt;
}

}  // namespace

std::string describe_lips(const scene::Landmarks& landmarks, const Vec3& up,
                          const std::vector<Vec3>& initial, const std::vector<Vec3>& moved) {
  for (const char* name : {"stomion", "upper_lip", "lower_lip"})
    if (!landmarks.contains(name)) return "";
  const auto pair = parted_vertex(landmarks.at("stomion"), initial);
  if (!pair) return "";
  const auto way = [&](size_t i) { return Vec3(moved[i] - initial[i]); };
  const Vec3 upper = way(nearest_point(landmarks.at("upper_lip"), initial)),
             lower = way(nearest_point(landmarks.at("lower_lip"), initial));
  Vec3 apart = way(pair->first) - way(pair->second);
  if (apart.dot(upper - lower) < 0) apart = -apart;  // the first one is of the lower lip
  const double gap = apart.dot(up);
  if (gap < closed) return "Lips closed. ";
  return fmt::format("Lips {:.1f} mm apart at stomion, together before. ", gap);
}

}  // namespace repose::app
