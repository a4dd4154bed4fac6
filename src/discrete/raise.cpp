#include <algorithm>

#include "by_column.h"
#include "deal.h"
#include "plan.h"
#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"
#include "repose/discrete/message.h"
#include "repose/discrete/part.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::PointSet;

/// The model of a rank's piece; refuses regions that hold no prism of any.
/// Collective.
model::Model raise_piece(MPI_Comm comm, const scene::Scene& scene,
                         const std::vector<surface::Surface>& bones, const Deal& deal) {
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
std::vector<int64_t> own_columns(const Deal& deal, int rank) {
  std::vector<int64_t> own;
  for (size_t c = 0; c < deal.owner.size(); ++c)
    if (deal.owner[c] == rank) own.push_back(static_cast<int64_t>(c));
  return own;
}

/// The means over the whole tissue: rank 0's effective modulus and, for all,
/// contact's stiffness. Collective.
void take_means(MPI_Comm comm, const scene::Scene& scene, const Deal& deal,
                const std::vector<int64_t>& own, model::Model& model, RaisedPart& raised) {
  const auto mine = pick(model::column_sums(model, deal.layers), own);
  const auto sums = gather_by_column(comm, deal.columns, pick(deal.piece.column, own), mine);
  base::on_first_rank(comm, [&] {
    raised.effective_modulus = model::effective_modulus(sums);
    model.contact.stiffness = model::contact_stiffness(scene, sums);
  });
  MPI_Bcast(&model.contact.stiffness, 1, MPI_DOUBLE, 0, comm);
}

/// Distributes contact of the piece's points, where any rank has contact.
/// Collective.
void plan_contact(MPI_Comm comm, model::Model& model, Plan& plan) {
  int64_t touching = !model.contact.touches.point.empty();
  MPI_Allreduce(MPI_IN_PLACE, &touching, 1, MPI_INT64_T, MPI_MAX, comm);
  if (touching == 0) {
    model.contact.bodies.clear();
    return;
  }
  base::together(comm, [&] { plan.bodies = mechanics::make_bodies(model); });
  plan.touch_offset = mechanics::touch_offsets(model, plan.bodies);
}

/// By the columns of a piece what a plan says of its points.
void number_points(const Deal& deal, Plan& plan) {
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
std::vector<int64_t> own_points(const Deal& deal, std::vector<int64_t> own) {
  std::sort(own.begin(), own.end(),
            [&](int64_t a, int64_t b) { return deal.place[a] < deal.place[b]; });
  std::vector<int64_t> rows;
  for (const int64_t c : own)
    for (int64_t a = 0; a < deal.layers; ++a) rows.push_back(c * deal.layers + a);
  return rows;
}

/// The whole model's rows in place of the piece's. `edge_row` [edges of the
/// piece].
void number_rows(const Deal& deal, const std::vector<int64_t>& edge_row, Part& part) {
  const auto triangles = static_cast<int64_t>(deal.piece.triangle.size());
  for (int64_t& row : part.point_row)
    row = deal.piece.column[row / deal.layers] * deal.layers + row % deal.layers;
  for (int64_t& row : part.prism_row)
    row = row / triangles * deal.triangles + deal.piece.triangle[row % triangles];
  for (int64_t& row : part.edge_row) row = edge_row[row];
  part.total_springs = 0;
  part.total_prisms = (deal.layers - 1) * deal.triangles;
}

/// Rows of the piece's edges in the whole model, −1 of those of others.
/// Collective.
ColumnRows rows_of_edges(MPI_Comm comm, int rank, const Deal& deal, const model::Model& model) {
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
void number_touches(MPI_Comm comm, const Deal& deal, RaisedPart& raised) {
  const model::Model& model = raised.part.model;
  std::vector<int64_t> column;
  for (const int64_t point : model.contact.touches.point)
    column.push_back(model.points.column[point]);
  ColumnRows rows = rows_by_column(comm, deal.columns, column);
  raised.touch_row = std::move(rows.row);
  raised.touches = rows.total;
}

model::Counts count_all(MPI_Comm comm, const Part& part, int64_t edges) {
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

RaisedPart raise(MPI_Comm comm, const model::Ground* ground, scene::Scene scene) {
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
  Part& part = raised.part;
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
