#include "pierced_columns.h"

#include <algorithm>

#include "repose/base/agreement.h"

namespace repose::solve {
namespace {

constexpr double reported_depth = 1.2;  // mm
constexpr int samples = 9;

/// A sampled place inside a body.
struct Sample {
  double depth = 0;  // mm
  Vec3 where = Vec3::Zero();
};

/// The deepest sample between two points, both left out; none if all are above the reported depth.
Sample deepest_between(const Vec3& from, const Vec3& to, const mechanics::RigidBody& body) {
  Sample deepest{reported_depth, Vec3::Zero()};
  const double half = (to - from).norm() / 2, enough = half - reported_depth;
  if (body.lower_bound(body.beside((from + to) / 2), enough) >= enough) return {};
  for (int k = 1; k <= samples; ++k) {
    const Vec3 x = from + (to - from) * (static_cast<double>(k) / (samples + 1));
    const Vec3 beside = body.beside(x);
    if (body.lower_bound(beside, -deepest.depth) >= -deepest.depth) continue;
    const double depth = -body.distance(beside).value;
    if (depth > deepest.depth) deepest = {depth, x};
  }
  return deepest.depth > reported_depth ? deepest : Sample{};
}

/// Owned points above a deepest one of their column, which is the next row.
std::vector<int64_t> second_deepest(MPI_Comm comm, const discrete::Part& part) {
  const model::Points& points = part.model.points;
  int32_t deepest = 0;
  for (const int32_t layer : points.layer) deepest = std::max(deepest, layer);
  const int64_t last = base::max_over_ranks(comm, deepest);
  std::vector<int64_t> rows;
  for (int64_t i = 0; i + 1 < part.owned_points; ++i)
    if (points.layer[i + 1] == last && points.layer[i] == last - 1 &&
        points.column[i] == points.column[i + 1])
      rows.push_back(i);
  return rows;
}

/// Sums the columns, and takes the deepest place of any rank.
void combine(MPI_Comm comm, PiercedColumns& found) {
  found.columns = base::sum_over_ranks(comm, found.columns);
  found.depth = base::max_over_ranks_with(comm, found.depth, found.body, found.where);
}

}  // namespace

PiercedColumns find_pierced_columns(discrete::Objective& objective) {
  const discrete::Positions& positions = objective.positions();
  const discrete::Part& part = positions.part();
  PiercedColumns found;
  if (!part.contact) return found;
  const std::vector<mechanics::RigidBody>& moved = objective.contact().bodies().bodies();
  const auto now = positions.local();
  const std::vector<Vec3>& before = part.model.points.position;
  for (const int64_t i : second_deepest(positions.comm(), part)) {
    bool pierced = false;
    for (size_t k = 0; k < moved.size(); ++k) {
      if (moved[k].bone() < 0) continue;
      const Sample sample = deepest_between(now[i], now[i + 1], moved[k]);
      if (sample.depth <= reported_depth ||
          deepest_between(before[i], before[i + 1], part.bodies[k]).depth > reported_depth)
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

}  // namespace repose::solve
