#include "lip_crease.h"

#include <algorithm>
#include <cmath>

#include "repose/anatomy/propose.h"

namespace repose::anatomy {
namespace {

constexpr double arm = 4;       // mm, to the skin above and below that a crease is measured by
constexpr double climb = 1;     // mm, by which the crease may rise or fall from column to column
constexpr double share = 0.25;  // of the depth in the middle, where it ends
constexpr double ending = 2.5;  // mm, over which it is that shallow
constexpr double widest_half = 45;  // mm
constexpr double behind = 6;        // mm, that what is seen through a gap lies behind the lips

/// Skin between the lips is missing, or lies far behind them.
bool is_gap(const FrontMap& skin, double x, double z, double lips) {
  const auto y = skin.depth(x, z);
  return !y || *y > lips + behind;
}

/// The gap around a height, as its lower and upper end.
std::optional<std::pair<double, double>> gap_at(const FrontMap& skin, double x, double z,
                                                double lips) {
  constexpr double reach = 12;  // mm
  const double step = skin.spacing();
  for (double off = 0; off <= reach; off += step)
    for (const double at : {z + off, z - off}) {
      if (!is_gap(skin, x, at, lips)) continue;
      double low = at, high = at;
      while (is_gap(skin, x, low - step, lips) && at - low < 40) low -= step;
      while (is_gap(skin, x, high + step, lips) && high - at < 40) high += step;
      if (at - low < 40 && high - at < 40) return std::pair(low, high);
    }
  return std::nullopt;
}

/// The height within `climb` of z at which the crease is deepest.
std::optional<std::pair<double, double>> deepest(const FrontMap& skin, double x, double z,
                                                 double reach) {
  std::optional<std::pair<double, double>> best;
  for (double at = z - reach; at <= z + reach; at += skin.spacing()) {
    const auto depth = crease_depth(skin, x, at);
    if (depth && (!best || *depth > best->second)) best = std::pair(at, *depth);
  }
  return best;
}

std::vector<Vec3> follow_side(const FrontMap& skin, double z, double middle, int side,
                              std::optional<double> end) {
  std::vector<Vec3> points;
  double shallow = 0, tilt = 0;
  const double step = skin.spacing(), last = end ? std::abs(*end) : widest_half;
  for (double x = step; x <= last; x += step) {
    const auto place = deepest(skin, side * x, z + tilt * step, climb);
    if (!place) break;
    shallow = place->second < share * middle ? shallow + step : 0;
    if (!end && shallow > ending) break;
    tilt = 0.9 * tilt + 0.1 * (place->first - z) / step;
    z = 0.5 * (z + tilt * step) + 0.5 * place->first;
    points.emplace_back(side * x, *skin.depth(side * x, place->first), z);
  }
  if (!end && shallow > 0)
    points.resize(points.size() - std::min(points.size(), static_cast<size_t>(shallow / step)));
  return points;
}

LipCrease follow_gap(const FrontMap& skin, double z, double lips) {
  LipCrease crease;
  crease.open = true;
  for (const int side : {-1, 1}) {
    double at = z;
    std::vector<Vec3> points;
    for (double x = 0; x <= widest_half; x += skin.spacing()) {
      const auto gap = gap_at(skin, side * x, at, lips + 0.02 * x * x);
      if (!gap || (x > 0 && std::abs((gap->first + gap->second) / 2 - at) > 2 * climb)) break;
      at = (gap->first + gap->second) / 2;
      crease.gap = std::max(crease.gap, gap->second - gap->first);
      const auto above = skin.depth(side * x, gap->second + skin.spacing());
      points.emplace_back(side * x, above.value_or(lips), at);
    }
    if (side < 0) {
      std::reverse(points.begin(), points.end());
      crease.points = points;
    } else if (!points.empty()) {
      crease.points.insert(crease.points.end(), points.begin() + 1, points.end());
    }
  }
  return crease;
}

}  // namespace

std::optional<double> crease_depth(const FrontMap& skin, double x, double z) {
  const auto here = skin.depth(x, z), above = skin.depth(x, z + arm),
             below = skin.depth(x, z - arm);
  if (!here || !above || !below) return std::nullopt;
  return *here - (*above + *below) / 2;
}

std::optional<double> open_mouth(const FrontMap& skin, double z) {
  constexpr double minimum = 1.5, above = 14;  // mm
  const auto lips = skin.foremost(0, z + above, 1);
  if (!lips) return std::nullopt;
  const auto gap = gap_at(skin, 0, z, *lips);
  if (!gap || gap->second - gap->first < minimum) return std::nullopt;
  return (gap->first + gap->second) / 2;
}

LipCrease follow_crease(const FrontMap& skin, double z, std::optional<double> right,
                        std::optional<double> left) {
  if (const auto gap = open_mouth(skin, z))
    return follow_gap(skin, *gap, skin.foremost(0, *gap + 14, 1).value_or(0));
  const auto middle = deepest(skin, 0, z, arm);
  if (!middle) return {};
  LipCrease crease;
  crease.points = follow_side(skin, middle->first, middle->second, -1, right);
  std::reverse(crease.points.begin(), crease.points.end());
  crease.points.emplace_back(0, *skin.depth(0, middle->first), middle->first);
  const auto other = follow_side(skin, middle->first, middle->second, 1, left);
  crease.points.insert(crease.points.end(), other.begin(), other.end());
  return crease;
}

}  // namespace repose::anatomy
