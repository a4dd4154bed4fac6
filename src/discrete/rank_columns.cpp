#include "rank_columns.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>

#include "countable.h"
#include "partition.h"
#include "piece.h"
#include "repose/base/agreement.h"
#include "repose/base/geometry.h"

namespace repose::discrete {

namespace {

using base::pick;

void copy_columns(const base::Message& copy, RankColumns& d) {
  model::Piece& p = d.piece;
  copy(p.column, p.skin, p.deep, p.ends.bone, p.ends.slides_on, p.ends.free, p.ends.support,
       p.ends.support_stiffness, p.ends.supported_whole, p.rim, p.parted, p.jaws, p.corner,
       p.triangle, p.edge, p.slope, p.loads.instrument, p.loads.target, p.loads.force,
       p.loads.layer_area);
  copy(d.owner, d.place, d.unknown, d.layers, d.columns, d.triangles, d.edges, d.unknowns,
       d.doubled);
  auto count = d.cuts.size();
  copy(count);
  d.cuts.resize(count);
  for (model::Cut& cut : d.cuts)
    copy(cut.columns, cut.layers, cut.meets, cut.lips, cut.around, cut.edge);
}

/// The graph of the skin, which is that of the model.
ColumnGraph graph_of(const model::ColumnGeometry& geometry) {
  const model::SkinMesh& skin = geometry.skin();
  ColumnGraph graph;
  graph.row_begin.push_back(0);
  for (int64_t c = 0; c < static_cast<int64_t>(skin.points.size()); ++c) {
    graph.weight.push_back(1 + geometry.soft_points(c));
    for (const int64_t edge : skin.edges_of[c]) graph.neighbor.push_back(skin.other_end(edge, c));
    std::sort(graph.neighbor.begin() + graph.row_begin.back(), graph.neighbor.end());
    graph.row_begin.push_back(static_cast<int64_t>(graph.neighbor.size()));
  }
  return graph;
}

/// The columns along cuts whose sides may meet, and those beside them, go to one rank.
void keep_cuts_whole(std::span<const model::Cut> cuts, std::vector<int>& owner) {
  const auto first = std::ranges::find_if(cuts, &model::Cut::meets);
  if (first == cuts.end()) return;
  const int rank = owner[first->columns.front()];
  for (const model::Cut& cut : cuts) {
    if (!cut.meets) continue;
    for (const int64_t column : cut.columns) owner[column] = rank;
    const std::set<int64_t> inner(cut.columns.begin() + 1, cut.columns.end() - 1);
    for (const Triangle& t : cut.around)
      if (std::ranges::any_of(t, [&](int64_t column) { return inner.contains(column); }))
        for (const int64_t column : t) owner[column] = rank;
  }
}

/// Distributes columns from rank 0.
class Distributor {
 public:
  Distributor(const model::ColumnGeometry& geometry, const ColumnGraph& graph,
              const std::vector<int>& owner, int ranks)
      : geometry_(geometry), owner_(owner), own_(ranks), unknown_begin_(ranks + 1) {
    const auto columns = static_cast<int64_t>(owner.size());
    const std::vector<int64_t> memory = memory_order(graph);
    std::vector<int64_t> order = base::all_rows(columns);
    std::sort(order.begin(), order.end(), [&](int64_t a, int64_t b) {
      return std::pair(owner[a], memory[a]) < std::pair(owner[b], memory[b]);
    });
    place_.resize(columns);
    unknown_.resize(columns);
    std::vector<int64_t> doubled(columns, 0);
    for (const model::DoubledColumn& at : geometry.doubled()) doubled[at.column] = at.points;
    int64_t points = 0, unknowns = 0;
    for (const int64_t c : order) {
      place_[c] = points;
      points += geometry.layers() + doubled[c];
      unknown_[c] = unknowns;
      unknowns += geometry.soft_points(c);
      unknown_begin_[owner[c] + 1] += geometry.soft_points(c);
    }
    std::partial_sum(unknown_begin_.begin(), unknown_begin_.end(), unknown_begin_.begin());
    for (int64_t c = 0; c < columns; ++c) own_[owner[c]].push_back(c);
  }

  RankColumns columns_of(int rank) const {
    RankColumns rank_columns;
    rank_columns.piece = geometry_.piece(own_[rank]);
    rank_columns.owner = pick(owner_, rank_columns.piece.column);
    rank_columns.place = pick(place_, rank_columns.piece.column);
    rank_columns.unknown = pick(unknown_, rank_columns.piece.column);
    rank_columns.layers = geometry_.layers();
    rank_columns.columns = static_cast<int64_t>(owner_.size());
    rank_columns.triangles = static_cast<int64_t>(geometry_.skin().triangles.size());
    rank_columns.edges = static_cast<int64_t>(geometry_.skin().edges.size());
    rank_columns.unknowns = unknown_blocks(unknown_begin_, rank);
    rank_columns.doubled = geometry_.doubled();
    rank_columns.cuts = {geometry_.cuts().begin(), geometry_.cuts().end()};
    for (model::Cut& cut : rank_columns.cuts)
      cut.meets = cut.meets && owner_[cut.columns.front()] == rank;
    return rank_columns;
  }

 private:
  const model::ColumnGeometry& geometry_;
  const std::vector<int>& owner_;
  std::vector<std::vector<int64_t>> own_;  // [ranks] columns
  std::vector<int64_t> place_, unknown_;   // [columns] as in RankColumns
  std::vector<int64_t> unknown_begin_;     // [ranks + 1]
};

}  // namespace

RankColumns distribute_columns(MPI_Comm comm, const model::ColumnGeometry* geometry,
                               model::Model& global_metadata,
                               std::vector<surface::Surface>& bones) {
  const int ranks = base::size(comm);
  ColumnGraph graph;
  base::on_root(comm, [&] {
    int64_t points = static_cast<int64_t>(geometry->skin().points.size()) * geometry->layers();
    for (const model::DoubledColumn& at : geometry->doubled()) points += at.points;
    require_countable(points);
    graph = graph_of(*geometry);
    global_metadata = geometry->global_metadata();
    bones = global_metadata.bone_surfaces;
  });
  std::vector<int> owner = partition(comm, graph);
  std::optional<Distributor> distributor;  // on rank 0
  base::on_root(comm, [&] {
    keep_cuts_whole(geometry->cuts(), owner);
    distributor.emplace(*geometry, graph, owner, ranks);
  });
  RankColumns rank_columns;
  for (int r = ranks - 1; r >= 0; --r) {
    base::on_root(comm, [&] { rank_columns = distributor->columns_of(r); });
    base::collective_try(comm, [&] {
      const base::Message copy(comm, 0, r);
      copy_columns(copy, rank_columns);
      copy_surfaces(copy, bones);
    });
  }
  return rank_columns;
}

}  // namespace repose::discrete
