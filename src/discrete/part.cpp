#include "repose/discrete/part.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "countable.h"
#include "partition.h"
#include "pass_bodies.h"
#include "plan.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"
#include "repose/discrete/message.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::Model;
using model::PointSet;

/// The shares of all ranks in one model.
struct Shares {
  std::vector<int64_t> order;          // [N] point rows by their places
  std::vector<int64_t> begin;          // [ranks + 1] into order
  std::vector<int64_t> unknown_begin;  // [ranks + 1]
  Share of(int rank) const {
    return {rank, std::span(order).subspan(begin[rank], begin[rank + 1] - begin[rank]),
            unknown_begin[rank], unknown_begin[rank + 1] - unknown_begin[rank]};
  }
};

Shares number_points(const ColumnGraph& graph, int ranks, Plan& plan) {
  const int64_t n = static_cast<int64_t>(plan.owner.size());
  Shares shares;
  shares.order.resize(n);
  for (int64_t i = 0; i < n; ++i) shares.order[i] = i;
  const std::vector<int64_t> column = pick(memory_order(graph), graph.column_of_point);
  std::stable_sort(shares.order.begin(), shares.order.end(), [&](int64_t a, int64_t b) {
    return std::pair(plan.owner[a], column[a]) < std::pair(plan.owner[b], column[b]);
  });
  plan.place.resize(n);
  for (int64_t k = 0; k < n; ++k) plan.place[shares.order[k]] = k;
  shares.begin.assign(ranks + 1, n);
  shares.unknown_begin.assign(ranks + 1, 0);
  plan.unknown.assign(n, -1);
  int64_t next = 0;
  int rank = -1;
  for (int64_t k = 0; k < n; ++k) {
    const int64_t row = shares.order[k];
    while (rank < plan.owner[row]) {
      shares.begin[++rank] = k;
      shares.unknown_begin[rank] = next;
    }
    if (plan.set[row] == PointSet::soft_tissue) plan.unknown[row] = next++;
  }
  while (rank < ranks - 1) shares.unknown_begin[++rank] = next;
  shares.unknown_begin[ranks] = next;
  plan.total_points = n;
  plan.total_unknowns = next;
  return shares;
}

/// The columns along cuts whose sides may meet go to one rank.
void keep_cuts_whole(const ColumnGraph& graph, Plan& plan) {
  const model::Walls& walls = plan.model.contact.walls;
  if (walls.empty()) return;
  const int owner = plan.owner[walls.point.front()];
  std::vector<char> moves(graph.columns(), 0);
  for (const int64_t point : walls.point) moves[graph.column_of_point[point]] = 1;
  for (size_t p = 0; p < plan.owner.size(); ++p)
    if (moves[graph.column_of_point[p]]) plan.owner[p] = owner;
}

void plan_contact(Plan& plan, const ColumnGraph& graph) {
  if (plan.model.contact.empty()) return;
  keep_cuts_whole(graph, plan);
  plan.bodies = mechanics::make_bodies(plan.model);
  plan.touch_offset = mechanics::touch_offsets(plan.model, plan.bodies);
}

template <class Archive>
void pass_elements(Archive& archive, std::vector<model::TermElements>& all) {
  auto count = static_cast<int64_t>(all.size());
  archive(count);
  all.resize(count);
  for (model::TermElements& elements : all) {
    std::vector<char> name(elements.term.begin(), elements.term.end());
    archive(name, elements.points_each, elements.numbers_each, elements.points, elements.numbers);
    elements.term.assign(name.begin(), name.end());
  }
}

/// Sends or receives a part: `archive` decides which.
template <class Archive>
void pass(Archive& archive, Part& part) {
  model::Model& m = part.model;
  archive(m.gravity, m.points.position, m.points.set, m.points.target, m.points.layer,
          m.points.column, m.points.bone, m.points.mass, m.points.external_force);
  archive(m.springs.points, m.springs.set, m.springs.rest_length, m.springs.stiffness,
          m.springs.exponent, m.springs.reference);
  archive(m.prisms.points, m.prisms.rest_volume, m.prisms.shear_modulus, m.prisms.modulus,
          m.prisms.target_volume, m.prisms.nodal_modulus, m.edges.points, m.edges.weight,
          m.bone_transform);
  model::Contact& c = m.contact;
  archive(c.stiffness, c.spacing, c.touches.point, c.touches.body, c.touches.binding,
          c.touches.area, c.touches.offset, c.walls.size, c.walls.begin, c.walls.point,
          c.walls.weight, c.walls.area, part.contact);
  pass_elements(archive, m.elements);
  pass_bodies(archive, part.bodies);
  pass_meshes(archive, part.body_meshes);
  archive(part.solid, part.owned_points, part.owned_springs, part.owned_prisms, part.owned_edges,
          part.point_row, part.spring_row, part.prism_row, part.edge_row, part.unknown);
  archive(part.first_unknown, part.owned_unknowns, part.total_points, part.total_springs,
          part.total_prisms, part.total_unknowns);
}

Plan make_plan(const Model& model, const ColumnGraph& graph, const std::vector<int>& column_owner) {
  Plan plan{model, pick(column_owner, graph.column_of_point), {}, {}, {}, {}, {}, {}};
  plan_motion(plan);
  plan_contact(plan, graph);
  return plan;
}

/// Rank 0 parts with `part`, which a rank takes over; the others do nothing.
void hand_over(MPI_Comm comm, int to, Part& part) {
  if (base::rank(comm) == 0) {
    Sender sender(comm, to);
    pass(sender, part);
    part = {};
  } else if (base::rank(comm) == to) {
    Receiver receiver(comm, 0);
    pass(receiver, part);
    part.model.bones.resize(part.model.bone_transform.size());  // as many, without their names
  }
}

}  // namespace

Part distribute(MPI_Comm comm, const Model& model) {
  static const PetscLogEvent event = base::log_event("RpPartition");
  const base::Logged logged(event);
  const int ranks = base::size(comm);
  ColumnGraph graph;
  base::on_first_rank(comm, [&] {
    require_countable(static_cast<int64_t>(model.points.position.size()));
    graph = column_graph(model);
  });
  const std::vector<int> column_owner = partition(comm, graph);
  std::optional<Plan> plan;  // on rank 0
  Shares shares;
  std::optional<LocalNumbers> local;
  base::on_first_rank(comm, [&] {
    plan.emplace(make_plan(model, graph, column_owner));
    shares = number_points(std::exchange(graph, {}), ranks, *plan);
    local.emplace(static_cast<int64_t>(plan->owner.size()));
  });
  Part part;
  for (int r = ranks - 1; r >= 0; --r) {
    base::on_first_rank(comm, [&] { part = make_part(*plan, shares.of(r), *local); });
    if (r == 0) break;
    base::together(comm, [&] { hand_over(comm, r, part); });
  }
  return part;
}

}  // namespace repose::discrete
