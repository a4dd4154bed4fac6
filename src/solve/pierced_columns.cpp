#include "pierced_columns.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "repose/base/agreement.h"

namespace repose::solve {
namespace {

/// A sampled place inside a body.
struct Sample {
  double depth = 0;  // mm
  Vec3 where = Vec3::Zero();
};

/// Rows of consecutive points of a column.
struct Rows {
  int64_t first = 0, last = 0;
};

/// Rule of sampling for bones or for instruments.
struct Sampling {
  bool bones;
  double min_depth;  // mm, from which samples count
  bool at_points;    // not only between them
};
constexpr Sampling in_bones{true, 1.2, false}, bones_between_columns{true, 0.6, true};

/// The depth of an instrument, mm, at most that of one larger than prisms.
double depth_of(const mechanics::RigidBody& body) {
  constexpr double thin = 1, thick = 10, least = 0.05;
  const double depth = body.deepest(thin);
  return std::max(least, depth < thin ? depth : body.deepest(thick));
}

/// Tissue is in an instrument where it is 0.5 mm deep in it, or half of the instrument's depth.
Sampling in_instrument(double depth) {
  constexpr double entered = 0.5;  // mm
  return {false, std::min(entered, depth / 2), true};
}

/// The deepest sample of a segment; none if all are above the least depth.
Sample deepest_between(const Vec3& from, const Vec3& to, const Sampling& rule,
                       const mechanics::RigidBody& body) {
  Sample deepest{rule.min_depth, Vec3::Zero()};
  constexpr double fewest = 9, most = 99;
  const double half = (to - from).norm() / 2, enough = half - rule.min_depth;
  if (body.lower_bound(body.beside((from + to) / 2), enough) >= enough) return {};
  const int samples = static_cast<int>(std::clamp(2 * half / rule.min_depth, fewest, most));
  for (int k = rule.at_points ? 0 : 1; k <= samples + (rule.at_points ? 1 : 0); ++k) {
    const Vec3 x = from + (to - from) * (static_cast<double>(k) / (samples + 1));
    const Vec3 beside = body.beside(x);
    if (body.lower_bound(beside, -deepest.depth) >= -deepest.depth) continue;
    const double depth = -body.distance(beside).value;
    if (depth > deepest.depth) deepest = {depth, x};
  }
  return deepest.depth > rule.min_depth ? deepest : Sample{};
}

/// The deepest of all segments between the rows.
Sample deepest_along(std::span<const Vec3> points, const Rows& rows, const Sampling& rule,
                     const mechanics::RigidBody& body) {
  Sample deepest;
  for (int64_t i = rows.first; i < rows.last; ++i) {
    const Sample sample = deepest_between(points[i], points[i + 1], rule, body);
    if (sample.depth > deepest.depth) deepest = sample;
  }
  return deepest;
}

int32_t deepest_layer(MPI_Comm comm, const discrete::Part& part) {
  int32_t deepest = 0;
  for (const int32_t layer : part.model.points.layer) deepest = std::max(deepest, layer);
  return base::max_over_ranks(comm, deepest);
}

/// Deepest segments of owned columns.
std::vector<Rows> deepest_segments(const discrete::Part& part, int32_t last) {
  const model::Points& points = part.model.points;
  std::vector<Rows> segments;
  for (int64_t i = 0; i + 1 < part.owned_points; ++i)
    if (points.layer[i + 1] == last && points.layer[i] == last - 1 &&
        points.column[i] == points.column[i + 1])
      segments.push_back({i, i + 1});
  return segments;
}

std::vector<Rows> free_columns(const discrete::Part& part) {
  const model::Points& points = part.model.points;
  std::vector<Rows> columns;
  for (int64_t first = 0; first < part.owned_points;) {
    int64_t last = first;
    while (last + 1 < part.owned_points && points.column[last + 1] == points.column[first] &&
           points.layer[last + 1] == points.layer[last] + 1)
      ++last;
    const auto begin = points.set.begin();
    if (std::find(begin + first, begin + last + 1, model::PointSet::soft_tissue) !=
        begin + last + 1)
      columns.push_back({first, last});
    first = last + 1;
  }
  return columns;
}

/// Sums the columns, and takes the deepest place of any rank.
void combine(MPI_Comm comm, PiercedColumns& found) {
  found.columns = base::sum_over_ranks(comm, found.columns);
  found.prisms = base::sum_over_ranks(comm, found.prisms);
  found.depth = base::max_over_ranks_with(comm, found.depth, found.body, found.where);
}

void take(const Sample& sample, size_t body, PiercedColumns& found) {
  if (sample.depth <= found.depth) return;
  found.body = static_cast<int32_t>(body);
  found.depth = sample.depth;
  found.where = sample.where;
}

/// Finds the columns that bones or instruments are in, and were not initially.
PiercedColumns find_columns(discrete::Objective& objective, const std::vector<Rows>& columns,
                            bool bones) {
  const discrete::Positions& positions = objective.positions();
  const discrete::Part& part = positions.part();
  const std::vector<mechanics::RigidBody>& moved = objective.contact().bodies().bodies();
  const std::vector<Vec3>& before = part.model.points.position;
  PiercedColumns found;
  std::vector<char> pierced(columns.size(), 0);
  for (size_t k = 0; k < moved.size(); ++k) {
    if ((moved[k].bone() >= 0) != bones) continue;
    const Sampling rule = bones ? in_bones : in_instrument(depth_of(moved[k]));
    for (size_t c = 0; c < columns.size(); ++c) {
      const Sample sample = deepest_along(positions.local(), columns[c], rule, moved[k]);
      if (sample.depth == 0 || deepest_along(before, columns[c], rule, part.bodies[k]).depth > 0)
        continue;
      pierced[c] = 1;
      take(sample, k, found);
    }
  }
  found.columns = std::ranges::count(pierced, char{1});
  return found;
}

/// Longest edge of the upper triangle of a prism.
double longest_edge(const std::array<Vec3, 6>& x) {
  return std::max({(x[1] - x[0]).norm(), (x[2] - x[1]).norm(), (x[0] - x[2]).norm()});
}

/// The deepest sample in a body of lines through a prism, about `apart` mm from one another, from
/// its upper to its lower triangle. Of a prism at the skin they begin a quarter of its longest edge
/// below: so far the plane triangle may cut through a ball that its corners touch.
Sample deepest_in_prism(const std::array<Vec3, 6>& x, bool at_skin, double apart,
                        const Sampling& rule, const mechanics::RigidBody& body) {
  constexpr int finest = 16;
  constexpr double cut_share = 0.25;
  const Vec3 middle = std::accumulate(x.begin(), x.end(), Vec3(0, 0, 0)) / x.size();
  double enough = -rule.min_depth;
  for (const Vec3& corner : x) enough = std::max(enough, (corner - middle).norm() - rule.min_depth);
  if (body.lower_bound(body.beside(middle), enough) >= enough) return {};
  const double longest = longest_edge(x);
  const int parts = std::clamp(static_cast<int>(std::ceil(longest / apart)), 2, finest);
  Sample deepest;
  for (int i = 0; i <= parts; ++i)
    for (int j = 0; i + j <= parts; ++j) {
      const double a = static_cast<double>(i) / parts, b = static_cast<double>(j) / parts;
      const Vec3 bottom = x[3] + a * (x[4] - x[3]) + b * (x[5] - x[3]);
      Vec3 top = x[0] + a * (x[1] - x[0]) + b * (x[2] - x[0]);
      if (at_skin)
        top += std::min(1.0, cut_share * longest / (bottom - top).norm()) * (bottom - top);
      const Sample sample = deepest_between(top, bottom, rule, body);
      if (sample.depth > deepest.depth) deepest = sample;
    }
  return deepest;
}

/// The points of a prism, those of its upper triangle first.
std::array<int64_t, 6> from_the_top(const model::Points& points, std::array<int64_t, 6> corners) {
  if (points.layer[corners[3]] < points.layer[corners[0]])
    std::ranges::rotate(corners, corners.begin() + 3);
  return corners;
}

/// Adds the prisms above the layer `last` that bones have entered, whose edges cut the corners of
/// those at bone, or that instruments smaller than these have entered.
void add_prisms(discrete::Objective& objective, bool bones, int32_t last, PiercedColumns& found) {
  const discrete::Positions& positions = objective.positions();
  const discrete::Part& part = positions.part();
  const model::Points& points = part.model.points;
  const std::vector<mechanics::RigidBody>& moved = objective.contact().bodies().bodies();
  for (size_t k = 0; k < moved.size(); ++k) {
    if ((moved[k].bone() >= 0) != bones) continue;
    const double depth = bones ? bones_between_columns.min_depth : depth_of(moved[k]);
    const Sampling rule = bones ? bones_between_columns : in_instrument(depth);
    for (int64_t m = 0; m < part.owned_prisms; ++m) {
      const std::array<int64_t, 6> corners = from_the_top(points, part.model.prisms.points[m]);
      const std::array<Vec3, 6> now = base::pick(positions.local(), corners);
      if (!model::touches_soft_tissue(points, corners) || depth >= longest_edge(now)) continue;
      if (bones && points.layer[corners[3]] == last) continue;
      const bool at_skin = points.layer[corners[0]] == 0;
      const auto in = [&](const std::array<Vec3, 6>& x, const mechanics::RigidBody& body) {
        return deepest_in_prism(x, at_skin, depth, rule, body);
      };
      const Sample sample = in(now, moved[k]);
      if (sample.depth == 0 || in(base::pick(points.position, corners), part.bodies[k]).depth > 0)
        continue;
      ++found.prisms;
      take(sample, k, found);
    }
  }
}

}  // namespace

PiercedColumns find_pierced_columns(discrete::Objective& objective) {
  const discrete::Positions& positions = objective.positions();
  if (!positions.part().contact) return {};
  const int32_t last = deepest_layer(positions.comm(), positions.part());
  PiercedColumns found = find_columns(objective, deepest_segments(positions.part(), last), true);
  add_prisms(objective, true, last, found);
  combine(positions.comm(), found);
  return found;
}

PiercedColumns find_columns_in_instruments(discrete::Objective& objective) {
  const discrete::Part& part = objective.positions().part();
  if (std::ranges::none_of(part.bodies, [](const auto& body) { return body.bone() < 0; }))
    return {};
  objective.contact().place_bodies();
  PiercedColumns found = find_columns(objective, free_columns(part), false);
  add_prisms(objective, false, -1, found);
  combine(objective.positions().comm(), found);
  return found;
}

}  // namespace repose::solve
