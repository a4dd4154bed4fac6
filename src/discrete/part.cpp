#include "repose/discrete/part.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "countable.h"
#include "partition.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"
#include "repose/discrete/message.h"
#include "repose/model/motion.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::Model;
using model::PointSet;

/// What rank 0 knows while it shares a model out.
struct Plan {
  const Model& model;
  std::vector<int> owner;              // [N] rank of each point
  std::vector<int64_t> order;          // [N] point rows, rank after rank, column after column
  std::vector<int64_t> place;          // [N] where each point row is in `order`
  std::vector<int64_t> rank_begin;     // [ranks + 1] into order
  std::vector<int64_t> unknown;        // [N] block number or −1
  std::vector<int64_t> unknown_begin;  // [ranks + 1]
  std::vector<PointSet> set;           // [N] with points of non-rigid bones as held
  std::vector<Mat4> bone_transform;    // [bones]
  std::vector<mechanics::RigidBody> bodies;
  std::vector<double> touch_offset;  // [touches] mm
};

void number_points(Plan& plan, const ColumnGraph& graph, int ranks) {
  const int64_t n = static_cast<int64_t>(plan.owner.size());
  plan.order.resize(n);
  for (int64_t i = 0; i < n; ++i) plan.order[i] = i;
  const std::vector<int64_t> column = pick(memory_order(graph), graph.column_of_point);
  std::stable_sort(plan.order.begin(), plan.order.end(), [&](int64_t a, int64_t b) {
    return std::pair(plan.owner[a], column[a]) < std::pair(plan.owner[b], column[b]);
  });
  plan.place.resize(n);
  for (int64_t k = 0; k < n; ++k) plan.place[plan.order[k]] = k;
  plan.rank_begin.assign(ranks + 1, n);
  plan.unknown_begin.assign(ranks + 1, 0);
  plan.unknown.assign(n, -1);
  int64_t next = 0;
  int rank = -1;
  for (int64_t k = 0; k < n; ++k) {
    const int64_t row = plan.order[k];
    while (rank < plan.owner[row]) {
      plan.rank_begin[++rank] = k;
      plan.unknown_begin[rank] = next;
    }
    if (plan.set[row] == PointSet::soft_tissue) plan.unknown[row] = next++;
  }
  while (rank < ranks - 1) plan.unknown_begin[++rank] = next;
  plan.unknown_begin[ranks] = next;
}

void plan_motion(Plan& plan) {
  const Model& model = plan.model;
  const model::PrescribedMotion motion(model);
  plan.set = model.points.set;
  for (size_t b = 0; b < model.bones.size(); ++b)
    plan.bone_transform.push_back(motion.bone_matrix(static_cast<int32_t>(b), 1.0));
  for (size_t p = 0; p < plan.set.size(); ++p)
    if (plan.set[p] == PointSet::bone && motion.straight(model.points.bone[p]))
      plan.set[p] = PointSet::held;
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

/// Gives local numbers to rows as they are met, owned points first.
class LocalNumbers {
 public:
  explicit LocalNumbers(int64_t rows) : local_(rows, -1) {}
  int64_t of(int64_t row) {
    if (local_[row] < 0) {
      local_[row] = static_cast<int64_t>(rows_.size());
      rows_.push_back(row);
    }
    return local_[row];
  }
  /// Forgets all, in time proportional to what was met.
  std::vector<int64_t> release() {
    for (int64_t row : rows_) local_[row] = -1;
    return std::exchange(rows_, {});
  }

 private:
  std::vector<int64_t> local_, rows_;
};

bool touches(const Plan& plan, std::span<const int64_t> element, int rank) {
  return std::any_of(element.begin(), element.end(), [&](int64_t row) {
    return plan.owner[row] == rank && plan.unknown[row] >= 0;
  });
}

/// [N] Of averaged volumes the points whose average one rank evaluates: its own, and those of the
/// prisms at its unknowns.
std::vector<char> averaged_points(const Plan& plan, int rank) {
  std::vector<char> averaged(plan.owner.size(), 0);
  for (size_t row = 0; row < averaged.size(); ++row) averaged[row] = plan.owner[row] == rank;
  for (const auto& prism : plan.model.prisms.points)
    if (plan.owner[prism[0]] == rank || touches(plan, prism, rank))
      for (const int64_t row : prism) averaged[row] = 1;
  return averaged;
}

/// Rows of the elements of one rank: those whose first point it owns, then those it also needs.
/// Both in blocks by where their first met point is, within a block as before: a loop then works on
/// points that fit into the cache together.
template <size_t n>
std::vector<int64_t> element_rows(const Plan& plan,
                                  const std::vector<std::array<int64_t, n>>& elements, int rank,
                                  int64_t& owned, const std::vector<char>& averaged = {}) {
  constexpr int64_t points_in_block = 1024;
  const int64_t blocks = static_cast<int64_t>(plan.place.size()) / points_in_block + 1;
  const auto block_of = [&](const std::array<int64_t, n>& element) {
    const bool mine = plan.owner[element[0]] == rank;
    const bool near = !averaged.empty() && std::any_of(element.begin(), element.end(),
                                                       [&](int64_t p) { return averaged[p] != 0; });
    if (!mine && !near && !touches(plan, element, rank)) return 2 * blocks;
    int64_t first = plan.place[element[0]];
    for (const int64_t point : element) first = std::min(first, plan.place[point]);
    return (mine ? 0 : blocks) + first / points_in_block;
  };
  std::vector<int64_t> begin(2 * blocks + 2, 0);
  for (const auto& element : elements) ++begin[block_of(element) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  owned = begin[blocks];
  std::vector<int64_t> rows(begin[2 * blocks]);
  for (size_t e = 0; e < elements.size(); ++e)
    if (const int64_t block = block_of(elements[e]); block < 2 * blocks)
      rows[begin[block]++] = static_cast<int64_t>(e);
  return rows;
}

template <size_t n>
void number(std::vector<std::array<int64_t, n>>& elements, LocalNumbers& local) {
  for (auto& element : elements)
    for (int64_t& point : element) point = local.of(point);
}

template <size_t n>
std::vector<std::array<int64_t, n>> pick_elements(
    const std::vector<std::array<int64_t, n>>& elements, const std::vector<int64_t>& rows,
    LocalNumbers& local) {
  std::vector<std::array<int64_t, n>> picked = pick(elements, rows);
  number(picked, local);
  return picked;
}

void pick_points(const Plan& plan, Part& part) {
  const model::Points& all = plan.model.points;
  model::Points& mine = part.model.points;
  mine.position = pick(all.position, part.point_row);
  mine.set = pick(plan.set, part.point_row);
  mine.target = pick(all.target, part.point_row);
  mine.layer = pick(all.layer, part.point_row);
  mine.column = pick(all.column, part.point_row);
  mine.bone = pick(all.bone, part.point_row);
  mine.mass = pick(all.mass, part.point_row);
  mine.external_force = pick(all.external_force, part.point_row);
  part.unknown = pick(plan.unknown, part.point_row);
}

/// The constraints of the points that a rank owns.
model::Contact pick_contact(const Plan& plan, LocalNumbers& local, int rank) {
  const model::Contact& all = plan.model.contact;
  const auto mine = [&](const std::vector<int64_t>& points) {
    std::vector<int64_t> rows;
    for (size_t c = 0; c < points.size(); ++c)
      if (plan.owner[points[c]] == rank && plan.unknown[points[c]] >= 0)
        rows.push_back(static_cast<int64_t>(c));
    return rows;
  };
  const auto number_all = [&](std::vector<int64_t>& points) {
    for (int64_t& point : points) point = local.of(point);
  };
  model::Contact part{all.stiffness, all.spacing, {}, {}, {}};
  const std::vector<int64_t> rows = mine(all.touches.point);
  part.touches = {pick(all.touches.point, rows), pick(all.touches.body, rows),
                  pick(all.touches.binding, rows), pick(all.touches.area, rows),
                  pick(plan.touch_offset, rows)};
  number_all(part.touches.point);
  if (all.walls.empty() || plan.owner[all.walls.point.front()] != rank) return part;
  part.walls = all.walls;
  number_all(part.walls.point);
  return part;
}

void pick_springs(const Plan& plan, LocalNumbers& local, int rank, Part& part) {
  const Model& model = plan.model;
  auto rows = element_rows(plan, model.springs.points, rank, part.owned_springs);
  part.model.springs = {pick_elements(model.springs.points, rows, local),
                        pick(model.springs.set, rows),
                        pick(model.springs.rest_length, rows),
                        pick(model.springs.stiffness, rows),
                        pick(model.springs.exponent, rows),
                        pick(model.springs.reference, rows)};
  rows.resize(part.owned_springs);
  part.spring_row = std::move(rows);
}

/// Prisms, and edges.
void pick_solid(const Plan& plan, LocalNumbers& local, int rank, Part& part) {
  const Model& model = plan.model;
  std::vector<char> averaged;
  if (!model.prisms.nodal_modulus.empty()) averaged = averaged_points(plan, rank);
  auto rows = element_rows(plan, model.prisms.points, rank, part.owned_prisms, averaged);
  part.model.prisms = model::pick_prisms(model.prisms, rows);
  number(part.model.prisms.points, local);
  rows.resize(part.owned_prisms);
  part.prism_row = std::move(rows);
  rows = element_rows(plan, model.edges.points, rank, part.owned_edges);
  part.model.edges = {pick_elements(model.edges.points, rows, local),
                      pick(model.edges.weight, rows)};
  rows.resize(part.owned_edges);
  part.edge_row = std::move(rows);
}

/// Those of further terms that a rank owns the first point of, or an unknown.
model::TermElements pick_elements(const Plan& plan, const model::TermElements& all,
                                  LocalNumbers& local, int rank) {
  model::TermElements mine{all.term, all.points_each, all.numbers_each, {}, {}};
  for (size_t e = 0; e < all.size(); ++e) {
    const auto points = all.points_of(e);
    const auto numbers = all.numbers_of(e);
    if (plan.owner[points[0]] != rank && !touches(plan, points, rank)) continue;
    for (const int64_t point : points) mine.points.push_back(local.of(point));
    mine.numbers.insert(mine.numbers.end(), numbers.begin(), numbers.end());
  }
  return mine;
}

Part make_part(const Plan& plan, LocalNumbers& local, int rank) {
  const Model& model = plan.model;
  Part part;
  part.owned_points = plan.rank_begin[rank + 1] - plan.rank_begin[rank];
  for (int64_t k = plan.rank_begin[rank]; k < plan.rank_begin[rank + 1]; ++k)
    local.of(plan.order[k]);
  pick_springs(plan, local, rank, part);
  pick_solid(plan, local, rank, part);
  for (const model::TermElements& elements : model.elements)
    part.model.elements.push_back(pick_elements(plan, elements, local, rank));
  part.model.contact = pick_contact(plan, local, rank);
  part.contact = !model.contact.empty();
  part.bodies = plan.bodies;
  part.point_row = local.release();
  pick_points(plan, part);
  part.solid = model::is_solid(model);
  part.model.gravity = model.gravity;
  part.model.bones = model.bones;
  part.model.bone_transform = plan.bone_transform;
  part.first_unknown = plan.unknown_begin[rank];
  part.owned_unknowns = plan.unknown_begin[rank + 1] - plan.unknown_begin[rank];
  part.total_points = static_cast<int64_t>(model.points.position.size());
  part.total_springs = static_cast<int64_t>(model.springs.points.size());
  part.total_prisms = static_cast<int64_t>(model.prisms.points.size());
  part.total_unknowns = plan.unknown_begin.back();
  return part;
}

template <class Archive>
void pass_shape(Archive& archive, mechanics::RigidBody::Shape& shape) {
  std::visit(
      [&](auto& of) {
        if constexpr (requires { of.pass(archive); })
          of.pass(archive);
        else
          archive(of);
      },
      shape);
}

void pass_bodies(Sender& archive, std::vector<mechanics::RigidBody>& bodies) {
  archive(static_cast<int64_t>(bodies.size()));
  for (const mechanics::RigidBody& body : bodies) {
    archive(body.bone(), body.push(), static_cast<int64_t>(body.shape().index()));
    auto shape = body.shape();
    pass_shape(archive, shape);
  }
}

/// One of the kind that is to be received.
mechanics::RigidBody::Shape empty_shape(int64_t index) {
  const Vec3 zero = Vec3::Zero();
  if (index == 0) return scene::Sphere{zero, 0};
  if (index == 1) return scene::Capsule{zero, zero, 0};
  if (index == 2) return scene::Box{zero, zero};
  if (index == 3) return scene::HalfSpace{zero, zero};
  return surface::DistanceField{};
}

void pass_bodies(Receiver& archive, std::vector<mechanics::RigidBody>& bodies) {
  int64_t count = 0, index = 0;
  archive(count);
  for (int64_t k = 0; k < count; ++k) {
    int32_t bone = -1;
    Vec3 push = Vec3::Zero();
    archive(bone, push, index);
    auto shape = empty_shape(index);
    pass_shape(archive, shape);
    bodies.emplace_back(std::move(shape), bone, push);
  }
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
  archive(part.solid, part.owned_points, part.owned_springs, part.owned_prisms, part.owned_edges,
          part.point_row, part.spring_row, part.prism_row, part.edge_row, part.unknown);
  archive(part.first_unknown, part.owned_unknowns, part.total_points, part.total_springs,
          part.total_prisms, part.total_unknowns);
}

Plan make_plan(const Model& model, const ColumnGraph& graph, const std::vector<int>& column_owner,
               int ranks) {
  Plan plan{model, pick(column_owner, graph.column_of_point), {}, {}, {}, {}, {}, {}, {}, {}, {}};
  plan_motion(plan);
  plan_contact(plan, graph);
  number_points(plan, graph, ranks);
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
  std::optional<LocalNumbers> local;
  base::on_first_rank(comm, [&] {
    plan.emplace(make_plan(model, std::exchange(graph, {}), column_owner, ranks));
    local.emplace(static_cast<int64_t>(plan->owner.size()));
  });
  Part part;
  for (int r = ranks - 1; r >= 0; --r) {
    base::on_first_rank(comm, [&] { part = make_part(*plan, *local, r); });
    if (r == 0) break;
    base::together(comm, [&] { hand_over(comm, r, part); });
  }
  return part;
}

}  // namespace repose::discrete
