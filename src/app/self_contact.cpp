#include "self_contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "report.h"
#include "repose/base/geometry.h"
#include "repose/surface/intersections.h"

namespace repose::app {

SolvedSkin::SolvedSkin(const Job& job) {
  if (job.local_model) {
    if (job.anatomy) initial_ = job.anatomy->skin;
    for (size_t i = 0; i < initial_.points.size(); ++i) row_.push_back(static_cast<int64_t>(i));
    on_a_side_.resize(row_.size(), 0);
    return;
  }
  for (const Triangle& t : job.model.skin) row_.insert(row_.end(), t.begin(), t.end());
  std::sort(row_.begin(), row_.end());
  row_.erase(std::unique(row_.begin(), row_.end()), row_.end());
  const auto number = [&](int64_t row) {
    return std::lower_bound(row_.begin(), row_.end(), row) - row_.begin();
  };
  for (const int64_t row : row_) initial_.points.push_back(job.model.points.position[row]);
  for (const Triangle& t : job.model.skin)
    initial_.triangles.push_back({number(t[0]), number(t[1]), number(t[2])});
  const std::set<int64_t> sides(job.model.contact.cut_faces.point.begin(),
                                job.model.contact.cut_faces.point.end());
  for (const int64_t row : row_) on_a_side_.push_back(sides.contains(row));
}

std::vector<Vec3> SolvedSkin::points_at(const std::vector<Vec3>& position) const {
  return base::pick(position, row_);
}

std::string SolvedSkin::describe_self_contact(const std::vector<Vec3>& position) const {
  surface::Surface now = initial_;
  now.points = points_at(position);
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
  return report_row(
      "self-contact",
      fmt::format("SKIN PASSES THROUGH SKIN: {} of its triangles, one at ({:.1f}, {:.1f}, {:.1f}) "
                  "mm; skin is kept apart only along incisions and mouth.path, so distrust the "
                  "result there, or move the bones less",
                  triangles.size(), at.x(), at.y(), at.z()));
}

}  // namespace repose::app
