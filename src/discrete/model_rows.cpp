#include "repose/discrete/model_rows.h"

#include "exchange.h"
#include "piece.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/surface/edges.h"

namespace repose::discrete {

namespace {

using model::Model;
using model::PointSet;

/// Makes a rank's rows a model of its own while it lives: its points are those of its slab and of
/// its elements, in local numbers.
class OwnModel {
 public:
  OwnModel(MPI_Comm comm, Model& rows) : rows_(rows) {
    const auto held = static_cast<int64_t>(rows.points.position.size());
    const int64_t first = base::count_before(comm, rows.points.position.size());
    RowIndex index(base::sum_over_ranks(comm, held));
    for (int64_t p = 0; p < held; ++p) index.add(first + p);
    for_each_point(rows, [&](int64_t point) { index.add(point); });
    row_ = index.sort();
    for_each_point(rows, [&](int64_t& point) { point = index.place(point); });
    slab_ = rows.points;
    const Exchange fetched = Exchange::fetch(comm, row_, held);
    model::for_each_array(rows.points,
                          [&](const char*, auto& values) { values = fetched(values); });
  }
  ~OwnModel() {
    for_each_point(rows_, [&](int64_t& point) { point = row_[point]; });
    rows_.points = std::move(slab_);
  }
  OwnModel(OwnModel&&) = delete;

  const std::vector<int64_t>& row() const { return row_; }  // [own points] of the whole
  const std::vector<PointSet>& slab_set() const { return slab_.set; }

 private:
  Model& rows_;
  model::Points slab_;
  std::vector<int64_t> row_;
};

void require_points(MPI_Comm comm, const Model& rows, const std::string& file) {
  const int64_t points = base::sum_over_ranks(comm, rows.points.position.size());
  base::collective_try(comm, [&] {
    for_each_point(rows, [&](int64_t point) {
      if (point < 0 || point >= points)
        base::refuse("{}: /model: point {} of an element, expected 0 to {}", file, point,
                     points - 1);
    });
  });
}

/// Pairs of points, in rows of the whole, that join what the rank's elements join.
std::vector<std::array<int64_t, 2>> joints(const Model& model, const std::vector<int64_t>& row) {
  surface::UnionFind parts(static_cast<int64_t>(row.size()));
  for (const auto& ends : model.springs.points) parts.unite(ends[0], ends[1]);
  for (const auto& ends : model.edges.points) parts.unite(ends[0], ends[1]);
  std::vector<std::array<int64_t, 2>> pairs;
  for (size_t i = 0; i < row.size(); ++i)
    if (const int64_t first = parts.find(static_cast<int64_t>(i)); row[first] != row[i])
      pairs.push_back({row[first], row[i]});
  return pairs;
}

/// Sums over the elements in their order, whatever the ranks.
double modulus_of(MPI_Comm comm, const Model& rows) {
  model::ColumnSums sums;
  for (int r = 0; r < base::size(comm); ++r) {
    if (base::rank(comm) == r) model::add_elements(rows, sums);
    base::Message(comm, r)(sums);
  }
  return model::effective_modulus(std::vector{sums});
}

}  // namespace

double validate(MPI_Comm comm, Model& rows, const std::string& file) {
  require_points(comm, rows, file);
  auto bones = rows.bones.size(), sets = rows.spring_sets.size();
  base::broadcast(comm, bones, sets, rows.bone_transform);
  rows.bones.resize(bones);
  rows.spring_sets.resize(sets);
  const OwnModel own(comm, rows);
  base::collective_try(comm, [&] {
    // A rank alone cannot tell what holds its tissue.
    for (PointSet& set : rows.points.set)
      if (set == PointSet::soft_tissue) set = PointSet::boundary;
    if (base::rank(comm) == 0 || !own.row().empty()) model::validate(rows, file);
  });
  const auto set = base::gather(comm, own.slab_set());
  const auto pairs = base::gather(comm, joints(rows, own.row()));
  base::on_root(comm, [&] {
    if (const int64_t row = model::find_floating(set, {pairs}); row >= 0)
      base::refuse("{}: /model/point: row {} is soft tissue, and nothing holds it", file, row);
  });
  if (base::rank(comm) > 0) {
    rows.spring_sets.clear();
    rows.bone_transform.clear();
  }
  return modulus_of(comm, rows);
}

}  // namespace repose::discrete
