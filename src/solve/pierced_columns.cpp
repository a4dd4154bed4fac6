#include "pierced_columns.h"

#include <algorithm>
#include <span>
#include <vector>

#include "repose/base/agreement.h"

namespace repose::solve {
namespace {

constexpr int samples = 9;

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
constexpr Sampling in_bones{true, 1.2, false}, in_instruments{false, 0.5, true};

/// The deepest sample of a segment; none if all are above the least depth.
Sample deepest_between(const Vec3& from, const Vec3& to, const Sampling& rule,
                       const mechanics::RigidBody& body) {
  Sample deepest{rule.min_depth, Vec3::Zero()};
  const double half = (to - from).norm() / 2, enough = half - rule.min_depth;
  if (body.lower_bound(body.beside((from + to) / 2), enough) >= enough) return {};
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

/// Deepest segments of owned columns.
std::vector<Rows> deepest_segments(MPI_Comm comm, const discrete::Part& part) {
  const model::Points& points = part.model.points;
  int32_t deepest = 0;
  for (const int32_t layer : points.layer) deepest = std::max(deepest, layer);
  const int64_t last = base::max_over_ranks(comm, deepest);
  std::vector<Rows> segments;
  for (int64_t i = 0; i + 1 < part.owned_points; ++i)
    if (points.layer[i + 1] == last && points.layer[i] == last - 1 &&
        points.column[i] == points.column[i + 1])
      segments.push_back({i, i + 1});
  return segments;
}

/// Owned columns that have free points.
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
  found.depth = base::max_over_ranks_with(comm, found.depth, found.body, found.where);
}

/// Finds the columns that bones or instruments are in, and were not initially.
PiercedColumns find_columns(discrete::Objective& objective, const std::vector<Rows>& columns,
                            const Sampling& rule) {
  const discrete::Positions& positions = objective.positions();
  const discrete::Part& part = positions.part();
  const std::vector<mechanics::RigidBody>& moved = objective.contact().bodies().bodies();
  const std::vector<Vec3>& before = part.model.points.position;
  PiercedColumns found;
  for (const Rows& column : columns) {
    bool pierced = false;
    for (size_t k = 0; k < moved.size(); ++k) {
      if ((moved[k].bone() >= 0) != rule.bones) continue;
      const Sample sample = deepest_along(positions.local(), column, rule, moved[k]);
      if (sample.depth == 0 || deepest_along(before, column, rule, part.bodies[k]).depth > 0)
        continue;
      pierced = true;
      if (sample.depth > found.depth)
        found = {found.columns, static_cast<int32_t>(k), sample.depth, sample.where};
    }
    found.columns += pierced;
  }
  combine(positions.comm(), found);
  return found;
}

}  // namespace

PiercedColumns find_pierced_columns(discrete::Objective& objective) {
  const discrete::Positions& positions = objective.positions();
  if (!positions.part().contact) return {};
  return find_columns(objective, deepest_segments(positions.comm(), positions.part()), in_bones);
}

PiercedColumns find_columns_in_instruments(discrete::Objective& objective) {
  const discrete::Part& part = objective.positions().part();
  if (!part.contact) return {};
  objective.contact().place_bodies();
  return find_columns(objective, free_columns(part), in_instruments);
}

}  // namespace repose::solve
