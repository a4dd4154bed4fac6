#include "repose/discrete/part.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "countable.h"
#include "distribution.h"
#include "message.h"
#include "partition.h"
#include "pass_bodies.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::Model;
using model::PointSet;

/// The shares of all ranks in one model.
struct OwnedRanges {
  std::vector<int64_t> order;          // [N] point rows by their places
  std::vector<int64_t> begin;          // [ranks + 1] into order
  std::vector<int64_t> unknown_begin;  // [ranks + 1]
  OwnedRange of(int rank) const {
    return {rank, std::span(order).subspan(begin[rank], begin[rank + 1] - begin[rank]),
            unknown_begin[rank], unknown_begin[rank + 1] - unknown_begin[rank]};
  }
};

OwnedRanges number_points(const ColumnGraph& graph, int ranks, Distribution& distribution) {
  const int64_t n = static_cast<int64_t>(distribution.owner.size());
  OwnedRanges ranges;
  ranges.order.resize(n);
  for (int64_t i = 0; i < n; ++i) ranges.order[i] = i;
  const std::vector<int64_t> column = pick(memory_order(graph), graph.column_of_point);
  std::stable_sort(ranges.order.begin(), ranges.order.end(), [&](int64_t a, int64_t b) {
    return std::pair(distribution.owner[a], column[a]) <
           std::pair(distribution.owner[b], column[b]);
  });
  distribution.place.resize(n);
  for (int64_t k = 0; k < n; ++k) distribution.place[ranges.order[k]] = k;
  ranges.begin.assign(ranks + 1, n);
  ranges.unknown_begin.assign(ranks + 1, 0);
  distribution.unknown.assign(n, -1);
  int64_t next = 0;
  int rank = -1;
  for (int64_t k = 0; k < n; ++k) {
    const int64_t row = ranges.order[k];
    while (rank < distribution.owner[row]) {
      ranges.begin[++rank] = k;
      ranges.unknown_begin[rank] = next;
    }
    if (distribution.set[row] == PointSet::soft_tissue) distribution.unknown[row] = next++;
  }
  while (rank < ranks - 1) ranges.unknown_begin[++rank] = next;
  ranges.unknown_begin[ranks] = next;
  distribution.total_points = n;
  distribution.total_unknowns = next;
  return ranges;
}

/// The columns along cuts whose sides may meet go to one rank.
void keep_cuts_whole(const ColumnGraph& graph, Distribution& distribution) {
  const model::CutFaces& cut_faces = distribution.model.contact.cut_faces;
  if (cut_faces.empty()) return;
  const int owner = distribution.owner[cut_faces.point.front()];
  std::vector<char> moves(graph.columns(), 0);
  for (const int64_t point : cut_faces.point) moves[graph.column_of_point[point]] = 1;
  for (size_t p = 0; p < distribution.owner.size(); ++p)
    if (moves[graph.column_of_point[p]]) distribution.owner[p] = owner;
}

void distribute_contact(Distribution& distribution, const ColumnGraph& graph) {
  if (distribution.model.contact.empty()) return;
  keep_cuts_whole(graph, distribution);
  distribution.bodies = mechanics::make_bodies(distribution.model);
  distribution.contact_offset = mechanics::contact_offsets(distribution.model, distribution.bodies);
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
  archive(c.stiffness, c.spacing, c.pairs.point, c.pairs.body, c.pairs.binding, c.pairs.area,
          c.pairs.offset, c.cut_faces.size, c.cut_faces.begin, c.cut_faces.point,
          c.cut_faces.weight, c.cut_faces.area, part.contact);
  pass_elements(archive, m.elements);
  pass_bodies(archive, part.bodies);
  pass_meshes(archive, part.body_meshes);
  archive(part.solid, part.owned_points, part.owned_springs, part.owned_prisms, part.owned_edges,
          part.point_row, part.spring_row, part.prism_row, part.edge_row, part.pair_row,
          part.original_set, part.unknown);
  archive(part.first_unknown, part.owned_unknowns, part.total_points, part.total_springs,
          part.total_prisms, part.total_unknowns);
}

Distribution make_distribution(const Model& model, const ColumnGraph& graph,
                               const std::vector<int>& column_owner) {
  Distribution distribution{model, pick(column_owner, graph.column_of_point), {}, {}, {}, {}, {},
                            {}};
  distribute_motion(distribution);
  distribute_contact(distribution, graph);
  return distribution;
}

/// Rank 0 parts with `part`, which a rank takes over; the others do nothing.
void send_part(MPI_Comm comm, int to, Part& part) {
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
  base::on_root(comm, [&] {
    require_countable(static_cast<int64_t>(model.points.position.size()));
    graph = column_graph(model);
  });
  const std::vector<int> column_owner = partition(comm, graph);
  std::optional<Distribution> distribution;  // on rank 0
  OwnedRanges ranges;
  std::optional<LocalNumbers> local;
  base::on_root(comm, [&] {
    distribution.emplace(make_distribution(model, graph, column_owner));
    ranges = number_points(std::exchange(graph, {}), ranks, *distribution);
    local.emplace(static_cast<int64_t>(distribution->owner.size()));
  });
  Part part;
  for (int r = ranks - 1; r >= 0; --r) {
    base::on_root(comm, [&] { part = make_part(*distribution, ranges.of(r), *local); });
    if (r == 0) break;
    base::collective_try(comm, [&] { send_part(comm, r, part); });
  }
  return part;
}

namespace {

/// Removes contact's pairs of points that are not free to move.
void remove_fixed_pairs(Model& model) {
  model::ContactPairs& pairs = model.contact.pairs;
  std::vector<int64_t> free;
  for (size_t c = 0; c < pairs.point.size(); ++c)
    if (model.points.set[pairs.point[c]] == PointSet::soft_tissue)
      free.push_back(static_cast<int64_t>(c));
  pairs = {pick(pairs.point, free), pick(pairs.body, free), pick(pairs.binding, free),
           pick(pairs.area, free)};
}

}  // namespace

LocalModel distribute_model(MPI_Comm comm, Model&& model) {
  LocalModel local_model;
  base::on_root(comm, [&] {
    remove_fixed_pairs(model);
    local_model.counts = model::count(model);
    local_model.contact_pairs = static_cast<int64_t>(model.contact.pairs.point.size());
  });
  MPI_Bcast(&local_model.counts, sizeof local_model.counts, MPI_BYTE, 0, comm);
  MPI_Bcast(&local_model.contact_pairs, 1, MPI_INT64_T, 0, comm);
  local_model.part = distribute(comm, model);
  local_model.outward = base::scatter(comm, model::outward_normals(model));
  model.points = {};
  model.springs = {};
  model.prisms = {};
  model.edges = {};
  model.contact.pairs = {};
  local_model.global_metadata = std::move(model);
  return local_model;
}

}  // namespace repose::discrete
