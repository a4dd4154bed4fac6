#include <algorithm>
#include <numeric>
#include <optional>

#include "by_column.h"
#include "countable.h"
#include "partition.h"
#include "pass_bodies.h"
#include "plan.h"
#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"
#include "repose/discrete/message.h"
#include "repose/discrete/part.h"
#include "repose/model/motion.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::PointSet;

/// What a rank is given: a piece of the ground, and where its columns stand in
/// the whole.
struct Deal {
  model::Piece piece;
  std::vector<int> owner;                          // [C] rank of each column
  std::vector<int64_t> place;                      // [C] of its first point, as in Plan
  std::vector<int64_t> unknown;                    // [C] block number of its first unknown
  int64_t layers = 0, columns = 0, triangles = 0;  // of the whole
  int64_t total_unknowns = 0, first_unknown = 0, unknowns = 0;
  double spacing = 0;  // mm, of contact's grids
  std::vector<scene::RigidMotion> moves;
};

template <class Archive>
void pass(Archive &archive, Deal &d) {
  model::Piece &p = d.piece;
  archive(p.column, p.skin, p.deep, p.bone, p.slides, p.free, p.rim, p.corner, p.triangle);
  archive(d.owner, d.place, d.unknown, d.layers, d.columns, d.triangles, d.total_unknowns,
          d.first_unknown, d.unknowns, d.spacing, d.moves);
}

template <class Archive>
void pass(Archive &archive, std::vector<surface::Surface> &bones) {
  auto count = static_cast<int64_t>(bones.size());
  archive(count);
  bones.resize(count);
  for (surface::Surface &bone : bones) archive(bone.points, bone.triangles);
}

/// As column_graph() of the model, but for the columns of its points.
ColumnGraph graph_of(const model::Ground &ground) {
  const model::SkinMesh &skin = ground.skin();
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

/// What rank 0 knows while it deals the ground out.
class Dealer {
 public:
  Dealer(const model::Ground &ground, const scene::Scene &scene, const ColumnGraph &graph,
         const std::vector<int> &owner, int ranks)
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
  const model::Ground &ground_;
  const scene::Scene &scene_;
  const std::vector<int> &owner_;
  std::vector<std::vector<int64_t>> own_;  // [ranks] columns
  std::vector<int64_t> place_, unknown_;   // [columns] as in Deal
  std::vector<int64_t> first_unknown_;     // [ranks + 1]
  int64_t unknowns_ = 0;
};

/// Every rank's deal, and the bones on all. Collective.
Deal deal_out(MPI_Comm comm, const model::Ground *ground, const scene::Scene &scene,
              model::Model &frame, std::vector<surface::Surface> &bones) {
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

/// The model of a rank's piece; refuses regions that hold no prism of any.
/// Collective.
model::Model raise_piece(MPI_Comm comm, const scene::Scene &scene,
                         const std::vector<surface::Surface> &bones, const Deal &deal) {
  model::Model model;
  std::vector<int64_t> found;
  base::together(comm, [&] { model = model::raise(scene, bones, deal.piece, found); });
  model.contact.spacing = deal.spacing;
  MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_INT64_T, MPI_SUM,
                comm);
  base::on_first_rank(comm, [&] { model::require_regions(found, scene.file.string()); });
  return model;
}

/// Rows of the piece's columns that a rank owns.
std::vector<int64_t> own_columns(const Deal &deal, int rank) {
  std::vector<int64_t> own;
  for (size_t c = 0; c < deal.owner.size(); ++c)
    if (deal.owner[c] == rank) own.push_back(static_cast<int64_t>(c));
  return own;
}

/// The means over the whole tissue: rank 0's effective modulus and, for all,
/// contact's stiffness. Collective.
void take_means(MPI_Comm comm, const scene::Scene &scene, const Deal &deal,
                const std::vector<int64_t> &own, model::Model &model, RaisedPart &raised) {
  const auto mine = pick(model::column_sums(model, deal.layers), own);
  const auto sums = gather_by_column(comm, deal.columns, pick(deal.piece.column, own), mine);
  base::on_first_rank(comm, [&] {
    raised.effective_modulus = model::effective_modulus(sums);
    model.contact.stiffness = model::contact_stiffness(scene, sums);
  });
  MPI_Bcast(&model.contact.stiffness, 1, MPI_DOUBLE, 0, comm);
}

/// The bodies, built by rank 0 from what all ranks ask for. Collective.
std::vector<mechanics::RigidBody> share_bodies(MPI_Comm comm, const model::Model &model) {
  double travel = model::PrescribedMotion(model).largest_travel(model);
  MPI_Allreduce(MPI_IN_PLACE, &travel, 1, MPI_DOUBLE, MPI_MAX, comm);
  std::vector<std::vector<char>> wanted;
  base::together(comm, [&] { wanted = mechanics::wanted_blocks(model, travel); });
  for (std::vector<char> &blocks : wanted)
    MPI_Allreduce(MPI_IN_PLACE, blocks.data(), static_cast<int>(blocks.size()), MPI_CHAR, MPI_MAX,
                  comm);
  std::vector<mechanics::RigidBody> bodies;
  base::on_first_rank(comm, [&] { bodies = mechanics::make_bodies(model, travel, wanted); });
  for (int to = 1; to < base::size(comm); ++to)
    base::together(comm, [&] {
      if (base::rank(comm) == 0) {
        Sender sender(comm, to);
        pass_bodies(sender, bodies);
      } else if (base::rank(comm) == to) {
        Receiver receiver(comm, 0);
        pass_bodies(receiver, bodies);
      }
    });
  return bodies;
}

/// What the piece's points touch, if those of any rank touch anything.
/// Collective.
void plan_contact(MPI_Comm comm, model::Model &model, Plan &plan) {
  int64_t touching = !model.contact.touches.point.empty();
  MPI_Allreduce(MPI_IN_PLACE, &touching, 1, MPI_INT64_T, MPI_MAX, comm);
  if (touching == 0) {
    model.contact.bodies.clear();
    return;
  }
  plan.bodies = share_bodies(comm, model);
  plan.touch_offset = mechanics::touch_offsets(model, plan.bodies);
}

/// By the columns of a piece what a plan says of its points.
void number_points(const Deal &deal, Plan &plan) {
  for (size_t c = 0; c < deal.owner.size(); ++c) {
    int64_t unknown = deal.unknown[c];
    for (int64_t a = 0; a < deal.layers; ++a) {
      plan.owner.push_back(deal.owner[c]);
      plan.place.push_back(deal.place[c] + a);
      const bool soft = plan.set[plan.unknown.size()] == PointSet::soft_tissue;
      plan.unknown.push_back(soft ? unknown++ : -1);
    }
  }
  plan.total_points = deal.columns * deal.layers;
  plan.total_unknowns = deal.total_unknowns;
}

/// Rows of the piece's points that a rank owns, by their places.
std::vector<int64_t> own_points(const Deal &deal, std::vector<int64_t> own) {
  std::sort(own.begin(), own.end(),
            [&](int64_t a, int64_t b) { return deal.place[a] < deal.place[b]; });
  std::vector<int64_t> rows;
  for (const int64_t c : own)
    for (int64_t a = 0; a < deal.layers; ++a) rows.push_back(c * deal.layers + a);
  return rows;
}

/// The whole model's rows in place of the piece's. `edge_row` [edges of the
/// piece].
void number_rows(const Deal &deal, const std::vector<int64_t> &edge_row, Part &part) {
  const auto triangles = static_cast<int64_t>(deal.piece.triangle.size());
  for (int64_t &row : part.point_row)
    row = deal.piece.column[row / deal.layers] * deal.layers + row % deal.layers;
  for (int64_t &row : part.prism_row)
    row = row / triangles * deal.triangles + deal.piece.triangle[row % triangles];
  for (int64_t &row : part.edge_row) row = edge_row[row];
  part.total_springs = 0;
  part.total_prisms = (deal.layers - 1) * deal.triangles;
}

/// Rows of the piece's edges in the whole model, −1 of those of others.
/// Collective.
ColumnRows rows_of_edges(MPI_Comm comm, int rank, const Deal &deal, const model::Model &model) {
  std::vector<int64_t> mine, column;
  for (size_t e = 0; e < model.edges.points.size(); ++e) {
    const int64_t c = model.edges.points[e][0] / deal.layers;
    if (deal.owner[c] != rank) continue;
    mine.push_back(static_cast<int64_t>(e));
    column.push_back(deal.piece.column[c]);
  }
  const ColumnRows rows = rows_by_column(comm, deal.columns, column);
  ColumnRows all{std::vector<int64_t>(model.edges.points.size(), -1), rows.total};
  for (size_t k = 0; k < mine.size(); ++k) all.row[mine[k]] = rows.row[k];
  return all;
}

/// Rows of contact in the whole model. Collective.
void number_touches(MPI_Comm comm, const Deal &deal, RaisedPart &raised) {
  const model::Model &model = raised.part.model;
  std::vector<int64_t> column;
  for (const int64_t point : model.contact.touches.point)
    column.push_back(model.points.column[point]);
  ColumnRows rows = rows_by_column(comm, deal.columns, column);
  raised.touch_row = std::move(rows.row);
  raised.touches = rows.total;
}

model::Counts count_all(MPI_Comm comm, const Part &part, int64_t edges) {
  int64_t of[4] = {};
  for (int64_t i = 0; i < part.owned_points; ++i) ++of[static_cast<int>(part.model.points.set[i])];
  MPI_Allreduce(MPI_IN_PLACE, of, 4, MPI_INT64_T, MPI_SUM, comm);
  model::Counts counts;
  counts.points = part.total_points;
  counts.soft = of[0], counts.boundary = of[1], counts.bone = of[2], counts.held = of[3];
  counts.prisms = part.total_prisms;
  counts.edges = edges;
  return counts;
}

}  // namespace

RaisedPart raise(MPI_Comm comm, const model::Ground *ground, scene::Scene scene) {
  static const PetscLogEvent event = base::log_event("RpPartition");
  const base::Logged logged(event);
  const int rank = base::rank(comm);
  RaisedPart raised;
  std::vector<surface::Surface> bones;
  const Deal deal = deal_out(comm, ground, scene, raised.frame, bones);
  scene.moves = deal.moves;
  model::Model model = raise_piece(comm, scene, bones, deal);
  const std::vector<int64_t> own = own_columns(deal, rank);
  take_means(comm, scene, deal, own, model, raised);
  Plan plan{model, {}, {}, {}, {}, {}, {}, {}};
  plan_motion(plan);
  plan_contact(comm, model, plan);
  number_points(deal, plan);
  const std::vector<int64_t> points = own_points(deal, own);
  LocalNumbers local(static_cast<int64_t>(plan.owner.size()));
  Part &part = raised.part;
  part = make_part(plan, {rank, points, deal.first_unknown, deal.unknowns}, local);
  part.solid = true;
  part.contact = !model.contact.bodies.empty();
  const ColumnRows edges = rows_of_edges(comm, rank, deal, model);
  number_rows(deal, edges.row, part);
  number_touches(comm, deal, raised);
  raised.outward = pick(model::outward_normals(model), points);
  raised.counts = count_all(comm, part, edges.total);
  raised.frame.contact.bodies = model.contact.bodies;
  raised.frame.contact.stiffness = model.contact.stiffness;
  return raised;
}

}  // namespace repose::discrete
