#include "lip_crease.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "mean_near_largest.h"
#include "repose/anatomy/propose.h"

namespace repose::anatomy {
namespace {

constexpr double arm = 4;          // mm, to the skin above and below that a crease is measured by
constexpr double averaged = 1.5;   // mm beside a place, over which depths of a crease are averaged
constexpr double climb = 1;        // mm, by which the crease may rise or fall from column to column
constexpr double share = 0.25;     // of the depth in the middle, where it ends
constexpr double ending = 2.5;     // mm, over which it is that shallow
constexpr double usual_depth = 4;  // mm, of a crease beside a gap
constexpr double widest_half = 45;  // mm
constexpr double behind = 6;        // mm, that what is seen through a gap lies behind a lip
constexpr double near = 2;          // mm, of a lip, beside the gap
constexpr double before = 3;        // mm, that the lower lip lies before what is seen there
constexpr double overjet = 25;      // mm, that the lower lip lies behind the upper one at most
constexpr double widest_gap = 40;   // mm
constexpr double middle = 4;  // mm beside the midline: a tooth or a wire may close some columns

/// Lowest and highest place between open lips, in one column of the map.
struct Gap {
  double low, high;
  double middle() const { return (low + high) / 2; }
};

/// The foremost y of a column from a height on over `near`.
std::optional<double> lip_above(const FrontMap& skin, double x, double z) {
  std::optional<double> lip;
  for (const double at : skin.steps(z, z + near))
    if (const auto y = skin.depth(x, at); y && (!lip || *y < *lip)) lip = y;
  return lip;
}

/// The lower end of the gap below `high`, behind a lip at `lip`: where skin stands before what is
/// seen above it. Nothing where it comes forward gradually: lips that touch, the lower far behind.
std::optional<double> low_end(const FrontMap& skin, double x, double high, double lip) {
  const auto is_lip = [&](std::optional<double> y) { return y && *y <= lip + overjet; };
  for (const double low : skin.steps(high, high - widest_gap, -1)) {
    const auto back = skin.depth(x, low), next = skin.depth(x, low - skin.spacing()),
               ahead = skin.depth(x, low - near);
    if (!is_lip(next)) continue;
    if (!is_lip(back) || (ahead && *ahead < *back - before)) return low;
    if (*next <= lip + behind) return std::nullopt;
  }
  return std::nullopt;
}

/// The uppermost gap whose upper end lies between two heights: skin is missing there, or steps back
/// behind the lip above it.
std::optional<Gap> gap_between(const FrontMap& skin, double x, double top, double bottom) {
  for (const double z : skin.steps(top, bottom, -1)) {
    const auto lip = lip_above(skin, x, z), next = skin.depth(x, z - skin.spacing());
    if (!lip || (next && *next <= *lip + behind)) continue;
    const double high = z - skin.spacing();
    if (const auto low = low_end(skin, x, high, *lip)) return Gap{*low, high};
  }
  return std::nullopt;
}

/// The gap near a height in the column nearest to the midline, if some of those there have one.
std::optional<Gap> middle_gap(const FrontMap& skin, double z) {
  constexpr double minimum = 1.5, above = 14, below = 12;  // mm
  constexpr double parted = 0.3;                           // of the columns
  std::optional<Gap> nearest;
  int columns = 0, open = 0;
  for (const double x : skin.steps(0, middle))
    for (const int side : {-1, 1}) {
      const auto gap = gap_between(skin, side * x, z + above, z - below);
      ++columns;
      if (!gap || gap->high - gap->low < minimum) continue;
      ++open;
      if (!nearest) nearest = gap;
    }
  return open >= parted * columns ? nearest : std::nullopt;
}

/// The mean depth of a crease over columns up to `averaged` beside x, so that noise of single
/// vertices does not end it; nothing where one of them has none.
std::optional<double> mean_depth(const FrontMap& skin, double x, double z) {
  double sum = 0;
  int columns = 0;
  for (const double at : skin.steps(x - averaged, x + averaged)) {
    const auto depth = crease_depth(skin, at, z);
    if (!depth) return std::nullopt;
    sum += *depth;
    ++columns;
  }
  return sum / columns;
}

/// A place of a crease in one column of the map.
struct Deepest {
  double height, depth;  // mm
  double y;              // of the skin
};

/// The place within `reach` of z at which the crease is deepest, of a flat stretch its middle.
std::optional<Deepest> deepest(const FrontMap& skin, double x, double z, double reach) {
  constexpr double flat = 0.2, stretch = 2.25;  // mm; between heights of cells
  std::vector<Deepest> places;
  for (const double at : skin.steps(z - reach, z + reach))
    if (const auto depth = mean_depth(skin, x, at))
      places.push_back({at, *depth, *skin.depth(x, at)});
  if (places.empty()) return std::nullopt;
  Deepest best = *std::ranges::max_element(places, {}, &Deepest::depth);
  std::erase_if(places,
                [&](const Deepest& p) { return std::abs(p.height - best.height) > stretch; });
  best.height =
      mean_near_largest(places, flat, std::mem_fn(&Deepest::depth), std::mem_fn(&Deepest::height));
  return best;
}

/// The crease on one side from a place, to a known corner of the mouth or, without it, to where it
/// is shallower than `share` of `depth`.
std::vector<Vec3> follow_side(const FrontMap& skin, const Vec3& from, double depth, int side,
                              const std::optional<Vec3>& end) {
  constexpr double bow = 4;  // mm, height of the crease at its start over a line to the corner
  std::vector<Vec3> points;
  double shallow = 0, tilt = 0, z = from.z();
  const double step = skin.spacing(), last = end ? std::abs(end->x()) : widest_half;
  const auto expected = [&](double x) {
    const double next = z + tilt * step;
    if (!end) return next;
    const double left = (last - x) / (last - std::abs(from.x()));
    const double line = left * from.z() + (1 - left) * end->z();
    return std::clamp(next, line - left * bow, line + left * bow);
  };
  for (const double x : skin.steps(std::abs(from.x()) + step, last)) {
    const auto place = deepest(skin, side * x, expected(x), climb);
    if (!place || place->y > (points.empty() ? from : points.back()).y() + behind) break;
    shallow = place->depth < share * depth ? shallow + step : 0;
    if (!end && shallow > ending) break;
    tilt = 0.9 * tilt + 0.1 * (place->height - z) / step;
    z = 0.5 * (z + tilt * step) + 0.5 * place->height;
    points.emplace_back(side * x, place->y, z);
  }
  if (!end && shallow > 0)
    points.resize(points.size() - std::min(points.size(), static_cast<size_t>(shallow / step)));
  return points;
}

/// Follows the gap between open lips, and where it ends the crease between lips that touch.
LipCrease follow_gap(const FrontMap& skin, const Gap& first) {
  LipCrease crease;
  crease.open = true;
  for (const int side : {-1, 1}) {
    Gap last = first;
    std::vector<Vec3> points;
    for (const double x : skin.steps(0, widest_half)) {
      const auto gap = gap_between(skin, side * x, last.high + near, last.low);
      if (!gap || (x > 0 && std::abs(gap->middle() - last.middle()) > 2 * climb)) {
        if (x > middle) break;
        continue;
      }
      const double edge = gap->high + skin.spacing();
      const auto lip = skin.depth(side * x, edge);
      const double y = lip ? *lip : *lip_above(skin, side * x, edge);
      if (!points.empty() && y > points.back().y() + behind) break;
      last = *gap;
      crease.gap = std::max(crease.gap, gap->high - gap->low);
      points.emplace_back(side * x, y, gap->middle());
    }
    if (points.empty()) continue;
    const auto beside = follow_side(skin, points.back(), usual_depth, side, {});
    points.insert(points.end(), beside.begin(), beside.end());
    if (side < 0) {
      std::reverse(points.begin(), points.end());
      crease.points = points;
    } else {
      const bool shared = !crease.points.empty() && points.front().x() == 0;
      crease.points.insert(crease.points.end(), points.begin() + shared, points.end());
    }
  }
  return crease;
}

/// Continues a side of a crease, whose end is given, to a distance from the midline, in parallel
/// with the other side or, beyond that, level.
std::vector<Vec3> mirrored(const FrontMap& skin, const std::vector<Vec3>& crease, const Vec3& end,
                           double half) {
  const auto height = [&](double x) {
    const auto away = [&](const Vec3& point) { return std::abs(point.x() - x); };
    return std::ranges::min_element(crease, {}, away)->z();
  };
  std::vector<Vec3> points;
  const int side = end.x() < 0 ? -1 : 1;
  double last = end.y();
  for (const double x : skin.steps(std::abs(end.x()) + skin.spacing(), half)) {
    const double z = end.z() + height(-side * x) - height(-end.x());
    const auto depth = skin.depth(side * x, z);
    if (depth && *depth <= last + behind) last = *depth;  // else it is a gap that is seen through
    points.emplace_back(side * x, last, z);
  }
  return points;
}

/// Puts the ends of a crease where corners of a mouth can be: one that ends nearer to the midline
/// is continued, and one that runs on farther is cut off.
void bound(const FrontMap& skin, LipCrease& crease) {
  constexpr double even = 0.7, nearest = 15;   // of the other side; mm
  constexpr double farthest = 34, usual = 25;  // mm
  std::vector<Vec3>& points = crease.points;
  const double right = -points.front().x(), left = points.back().x();
  const auto [narrow, wide] = std::minmax(right, left);
  const bool one_fits = narrow >= nearest && narrow <= farthest;
  const double half = wide <= farthest ? std::max(wide, nearest) : one_fits ? narrow : usual;
  if (narrow >= std::max(even * half, nearest) && wide <= half) return;
  crease.lost = {right, left};
  std::erase_if(points, [&](const Vec3& point) { return std::abs(point.x()) > half; });
  const auto on_the_right = mirrored(skin, points, points.front(), half),
             on_the_left = mirrored(skin, points, points.back(), half);
  points.insert(points.begin(), on_the_right.rbegin(), on_the_right.rend());
  points.insert(points.end(), on_the_left.begin(), on_the_left.end());
}

LipCrease follow_touching(const FrontMap& skin, double z, const std::optional<Vec3>& right,
                          const std::optional<Vec3>& left) {
  const auto middle = deepest(skin, 0, z, arm);
  if (!middle) return {};
  LipCrease crease;
  const Vec3 start(0, middle->y, middle->height);
  const double depth = std::min(middle->depth, usual_depth);  // more is that of a narrow gap
  crease.points = follow_side(skin, start, depth, -1, right);
  std::reverse(crease.points.begin(), crease.points.end());
  crease.points.push_back(start);
  const auto other = follow_side(skin, start, depth, 1, left);
  crease.points.insert(crease.points.end(), other.begin(), other.end());
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
  const auto gap = middle_gap(skin, z);
  return gap ? std::optional(gap->middle()) : std::nullopt;
}

LipCrease follow_crease(const FrontMap& skin, double z, const std::optional<Vec3>& right,
                        const std::optional<Vec3>& left) {
  const auto gap = middle_gap(skin, z);
  LipCrease crease = gap ? follow_gap(skin, *gap) : follow_touching(skin, z, right, left);
  if (!right && !left && !crease.points.empty()) bound(skin, crease);
  return crease;
}

}  // namespace repose::anatomy
