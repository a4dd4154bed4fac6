#include "deal.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "countable.h"
#include "partition.h"
#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/discrete/message.h"

namespace repose::discrete {

namespace {

using base::pick;

template <class Archive>
void pass(Archive& archive, Deal& d) {
  model::Piece& p = d.piece;
  archive(p.column, p.skin, p.deep, p.bone, p.slides, p.free, p.rim, p.corner, p.triangle);
  archive(d.owner, d.place, d.unknown, d.layers, d.columns, d.triangles, d.total_unknowns,
          d.first_unknown, d.unknowns, d.spacing, d.moves);
}

template <class Archive>
void pass(Archive& archive, std::vector<surface::Surface>& bones) {
  auto count = static_cast<int64_t>(bones.size());
  archive(count);
  bones.resize(count);
  for (surface::Surface& bone : bones) archive(bone.points, bone.triangles);
}

/// As column_graph() of the model, but for the columns of its points.
ColumnGraph graph_of(const model::Ground& ground) {
  const model::SkinMesh& skin = ground.skin();
  ColumnGraph graph;
  graph.row_begin.push_back(0);
  for (int64_t c = 0; c < static_cast<int64_t>(skin.points.size()); ++c) {
    graph.weight.push_back(1 + ground.soft_points(c));
    for (const int64_t edge : skin.edges_of[c]) graph.neighbour.push_back(skin.other_end(edge, c));
    std::sort(graph.neighbour.begin() + graph.row_begin.back(), graph.neighbour.end());
    graph.row_begin.push_back(static_cast<int64_t>(graph.neighbour.size()));
  }
  return graph;
}

/// Distributes columns from rank 0.
class Dealer {
 public:
  Dealer(const model::Ground& ground, const scene::Scene& scene, const ColumnGraph& graph,
         const std::vector<int>& owner, int ranks)
      : ground_(ground), scene_(scene), owner_(owner), own_(ranks), first_unknown_(ranks + 1) {
    const auto columns = static_cast<int64_t>(owner.size());
    const std::vector<int64_t> memory = memory_order(graph);
    std::vector<int64_t> order(columns);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int64_t a, int64_t b) {
      return std::pair(owner[a], memory[a]) < std::pair(owner[b], memory[b]);
    });
    place_.resize(columns);
    unknown_.resize(columns);
    for (int64_t k = 0; k < columns; ++k) {
      const int64_t c = order[k];
      place_[c] = k * ground.layers();
      unknown_[c] = unknowns_;
      unknowns_ += ground.soft_points(c);
      first_unknown_[owner[c] + 1] += ground.soft_points(c);
    }
    std::partial_sum(first_unknown_.begin(), first_unknown_.end(), first_unknown_.begin());
    for (int64_t c = 0; c < columns; ++c) own_[owner[c]].push_back(c);
  }

  Deal deal(int rank, double spacing) const {
    Deal deal;
    deal.piece = ground_.piece(own_[rank]);
    deal.owner = pick(owner_, deal.piece.column);
    deal.place = pick(place_, deal.piece.column);
    deal.unknown = pick(unknown_, deal.piece.column);
    deal.layers = ground_.layers();
    deal.columns = static_cast<int64_t>(owner_.size());
    deal.triangles = static_cast<int64_t>(ground_.skin().triangles.size());
    deal.total_unknowns = unknowns_;
    deal.first_unknown = first_unknown_[rank];
    deal.unknowns = first_unknown_[rank + 1] - first_unknown_[rank];
    deal.spacing = spacing;
    deal.moves = scene_.moves;
    return deal;
  }

 private:
  const model::Ground& ground_;
  const scene::Scene& scene_;
  const std::vector<int>& owner_;
  std::vector<std::vector<int64_t>> own_;  // [ranks] columns
  std::vector<int64_t> place_, unknown_;   // [columns] as in Deal
  std::vector<int64_t> first_unknown_;     // [ranks + 1]
  int64_t unknowns_ = 0;
};

}  // namespace

Deal deal_out(MPI_Comm comm, const model::Ground* ground, const scene::Scene& scene,
              model::Model& frame, std::vector<surface::Surface>& bones) {
  const int ranks = base::size(comm), rank = base::rank(comm);
  ColumnGraph graph;
  base::on_first_rank(comm, [&] {
    require_countable(static_cast<int64_t>(ground->skin().points.size()) * ground->layers());
    graph = graph_of(*ground);
    frame = ground->frame();
    bones = frame.bone_surfaces;
  });
  const std::vector<int> owner = partition(comm, graph);
  std::optional<Dealer> dealer;  // on rank 0
  base::on_first_rank(comm, [&] { dealer.emplace(*ground, scene, graph, owner, ranks); });
  Deal deal;
  for (int r = ranks - 1; r >= 0; --r) {
    base::on_first_rank(comm, [&] { deal = dealer->deal(r, frame.contact.spacing); });
    if (r == 0) break;
    base::together(comm, [&] {
      if (rank == 0) {
        Sender sender(comm, r);
        pass(sender, deal);
        pass(sender, bones);
      } else if (rank == r) {
        Receiver receiver(comm, 0);
        pass(receiver, deal);
        pass(receiver, bones);
      }
    });
  }
  return deal;
}

}  // namespace repose::discrete
