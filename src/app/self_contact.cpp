#include "self_contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "report.h"
#include "repose/base/collective.h"
#include "repose/discrete/natural_rows.h"
#include "repose/surface/intersections.h"

namespace repose::app {

SolvedSkin::SolvedSkin(MPI_Comm comm, const Job& job) : comm_(comm) {
  const model::Model& model = job.local_model.global_metadata;
  for (const Triangle& t : model.skin) row_.insert(row_.end(), t.begin(), t.end());
  base::sort_unique(row_);
  const auto number = [&](int64_t row) {
    return std::lower_bound(row_.begin(), row_.end(), row) - row_.begin();
  };
  for (const Triangle& t : model.skin)
    initial_.triangles.push_back({number(t[0]), number(t[1]), number(t[2])});
  const std::vector<int64_t>& beside = model.contact.cut_faces.point;
  const std::set<int64_t> sides(beside.begin(), beside.end());
  for (const int64_t row : row_) on_a_side_.push_back(sides.contains(row));
  base::broadcast(comm, row_);
  const discrete::Part& part = job.local_model.part;
  initial_.points =
      points_at(discrete::NaturalRows(comm, part).natural(part.model.points.position));
}

std::vector<Vec3> SolvedSkin::points_at(const std::vector<Vec3>& slab) const {
  const int64_t begin = base::count_before(comm_, slab.size()),
                end = begin + static_cast<int64_t>(slab.size());
  std::vector<Vec3> mine;
  for (const int64_t row : row_)
    if (row >= begin && row < end) mine.push_back(slab[row - begin]);
  return base::gather(comm_, std::move(mine));
}

std::string SolvedSkin::describe_self_contact(const std::vector<Vec3>& points) const {
  surface::Surface now = initial_;
  now.points = points;
  const auto beside_cut = [&](int64_t triangle) {
    return std::ranges::any_of(now.triangles[triangle],
                               [&](int64_t point) { return on_a_side_[point] != 0; });
  };
  std::set<int64_t> triangles;
  for (const auto& [a, b] : surface::new_intersections(initial_, now)) {
    if (beside_cut(a) && beside_cut(b)) continue;
    triangles.insert({a, b});
  }
  if (triangles.empty()) return "";
  const surface::Corners first = surface::corners(now, now.triangles[*triangles.begin()]);
  const Vec3 at = (first[0] + first[1] + first[2]) / 3;
  return report_row("self-contact",
                    "SKIN PASSES THROUGH SKIN: {} of its triangles, one at {:.1f} mm; "
                    "skin is kept apart only along incisions and mouth.path, so "
                    "distrust the result there, or move the bones less",
                    triangles.size(), at);
}

}  // namespace repose::app
