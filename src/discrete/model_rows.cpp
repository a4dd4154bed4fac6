#include "repose/discrete/model_rows.h"

#include "exchange.h"
#include "piece.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/model/stiffness.h"
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

/// Refuses soft tissue that is joined to no other point, as model::validate. On rank 0.
void refuse_floating(const std::vector<PointSet>& set,
                     const std::vector<std::array<int64_t, 2>>& pairs, const std::string& file) {
  surface::UnionFind parts(static_cast<int64_t>(set.size()));
  for (const auto& [p, q] : pairs) parts.unite(p, q);
  std::vector<char> held(set.size(), 0);
  for (size_t i = 0; i < set.size(); ++i)
    if (set[i] != PointSet::soft_tissue) held[parts.find(static_cast<int64_t>(i))] = 1;
  for (size_t i = 0; i < set.size(); ++i)
    if (!held[parts.find(static_cast<int64_t>(i))])
      base::refuse("{}: /model/point: row {} is soft tissue, and nothing holds it", file, i);
}

}  // namespace

void validate(MPI_Comm comm, Model& rows, const std::string& file) {
  require_points(comm, rows, file);
  auto bones = rows.bones.size(), sets = rows.spring_sets.size();
  base::broadcast(comm, bones, sets);
  rows.bones.resize(bones);
  rows.spring_sets.resize(sets);
  {
    const OwnModel own(comm, rows);
    base::collective_try(comm, [&] {
      // A rank alone cannot tell what holds its tissue.
      for (PointSet& set : rows.points.set)
        if (set == PointSet::soft_tissue) set = PointSet::boundary;
      if (base::rank(comm) == 0 || !own.row().empty()) model::validate(rows, file);
    });
    const auto set = base::gather(comm, own.slab_set());
    const auto pairs = base::gather(comm, joints(rows, own.row()));
    base::on_root(comm, [&] { refuse_floating(set, pairs, file); });
  }
  if (base::rank(comm) > 0) rows.spring_sets.clear();
}

double effective_modulus(MPI_Comm comm, Model& rows) {
  const OwnModel own(comm, rows);
  model::Stiffness sums;
  for (int r = 0; r < base::size(comm); ++r) {
    if (base::rank(comm) == r) model::add_stiffness(rows, sums);
    base::Message(comm, r)(sums);
  }
  return sums.modulus();
}

}  // namespace repose::discrete
