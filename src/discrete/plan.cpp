#include "plan.h"

#include <algorithm>
#include <numeric>

#include "repose/base/geometry.h"
#include "repose/model/motion.h"

namespace repose::discrete {

using base::pick;
using model::Model;
using model::PointSet;

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

namespace {

bool touches(const Plan& plan, std::span<const int64_t> element, int rank) {
  return std::any_of(element.begin(), element.end(), [&](int64_t row) {
    return plan.owner[row] == rank && plan.unknown[row] >= 0;
  });
}

/// [N] Points around which one rank has all prisms of a solid: its own, because those of an edge
/// say how stiff it is (solve/prestress.h), and where volumes are averaged those of the prisms at
/// its unknowns.
std::vector<char> surrounded_points(const Plan& plan, int rank) {
  std::vector<char> surrounded(plan.owner.size(), 0);
  for (size_t row = 0; row < surrounded.size(); ++row) surrounded[row] = plan.owner[row] == rank;
  if (plan.model.prisms.nodal_modulus.empty()) return surrounded;
  for (const auto& prism : plan.model.prisms.points)
    if (plan.owner[prism[0]] == rank || touches(plan, prism, rank))
      for (const int64_t row : prism) surrounded[row] = 1;
  return surrounded;
}

/// Rows of the elements of one rank: those whose first point it owns, then those it also needs.
/// Both in blocks by where their first met point is, within a block as before: a loop then works on
/// points that fit into the cache together.
template <size_t n>
std::vector<int64_t> element_rows(const Plan& plan,
                                  const std::vector<std::array<int64_t, n>>& elements, int rank,
                                  int64_t& owned, const std::vector<char>& surrounded = {}) {
  constexpr int64_t points_in_block = 1024;
  const int64_t blocks = plan.total_points / points_in_block + 1;
  const auto block_of = [&](const std::array<int64_t, n>& element) {
    const bool mine = plan.owner[element[0]] == rank;
    const bool near =
        !surrounded.empty() &&
        std::any_of(element.begin(), element.end(), [&](int64_t p) { return surrounded[p] != 0; });
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

/// [bodies] Triangles of the model's bodies at load 0; empty for closed forms.
std::vector<surface::Surface> body_meshes(const Model& model) {
  std::vector<surface::Surface> meshes;
  for (const model::Body& body : model.contact.bodies) {
    const auto* shape = std::get_if<surface::Surface>(&body.shape);
    if (body.bone >= 0) shape = &model.bone_surfaces[body.bone];
    meshes.push_back(shape ? *shape : surface::Surface{});
  }
  return meshes;
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
  std::vector<char> surrounded;
  if (model::is_solid(model)) surrounded = surrounded_points(plan, rank);
  auto rows = element_rows(plan, model.prisms.points, rank, part.owned_prisms, surrounded);
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

}  // namespace

Part make_part(const Plan& plan, const Share& share, LocalNumbers& local) {
  const Model& model = plan.model;
  const int rank = share.rank;
  Part part;
  part.owned_points = static_cast<int64_t>(share.points.size());
  for (const int64_t row : share.points) local.of(row);
  pick_springs(plan, local, rank, part);
  pick_solid(plan, local, rank, part);
  for (const model::TermElements& elements : model.elements)
    part.model.elements.push_back(pick_elements(plan, elements, local, rank));
  part.model.contact = pick_contact(plan, local, rank);
  part.contact = !model.contact.empty();
  part.bodies = plan.bodies;
  if (!plan.bodies.empty()) part.body_meshes = body_meshes(model);
  part.point_row = local.release();
  pick_points(plan, part);
  part.solid = model::is_solid(model);
  part.model.gravity = model.gravity;
  part.model.bones = model.bones;
  part.model.bone_transform = plan.bone_transform;
  part.first_unknown = share.first_unknown;
  part.owned_unknowns = share.unknowns;
  part.total_points = plan.total_points;
  part.total_springs = static_cast<int64_t>(model.springs.points.size());
  part.total_prisms = static_cast<int64_t>(model.prisms.points.size());
  part.total_unknowns = plan.total_unknowns;
  return part;
}

}  // namespace repose::discrete
