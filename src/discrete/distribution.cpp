#include "distribution.h"

#include <algorithm>
#include <numeric>

#include "repose/base/geometry.h"
#include "repose/model/motion.h"

namespace repose::discrete {

using base::pick;
using model::Model;
using model::PointSet;

void distribute_motion(Distribution& distribution) {
  const Model& model = distribution.model;
  const model::PrescribedMotion motion(model);
  distribution.set = model.points.set;
  for (size_t b = 0; b < model.bones.size(); ++b)
    distribution.bone_transform.push_back(motion.bone_matrix(static_cast<int32_t>(b), 1.0));
  for (size_t p = 0; p < distribution.set.size(); ++p)
    if (distribution.set[p] == PointSet::bone && motion.straight(model.points.bone[p]))
      distribution.set[p] = PointSet::held;
}

namespace {

bool touches(const Distribution& distribution, std::span<const int64_t> element, int rank) {
  return std::any_of(element.begin(), element.end(), [&](int64_t row) {
    return distribution.owner[row] == rank && distribution.unknown[row] >= 0;
  });
}

/// [N] Points around which one rank has all prisms of a solid: its own, because those of an edge
/// say how stiff it is (solve/prestress.h), and where volumes are averaged those of the prisms at
/// its unknowns.
std::vector<char> surrounded_points(const Distribution& distribution, int rank) {
  std::vector<char> surrounded(distribution.owner.size(), 0);
  for (size_t row = 0; row < surrounded.size(); ++row)
    surrounded[row] = distribution.owner[row] == rank;
  if (distribution.model.prisms.nodal_modulus.empty()) return surrounded;
  for (const auto& prism : distribution.model.prisms.points)
    if (distribution.owner[prism[0]] == rank || touches(distribution, prism, rank))
      for (const int64_t row : prism) surrounded[row] = 1;
  return surrounded;
}

/// Rows of the elements of one rank: those whose first point it owns, then those it also needs.
/// Both in blocks by where their first met point is, within a block as before: a loop then works on
/// points that fit into the cache together.
template <size_t n>
std::vector<int64_t> element_rows(const Distribution& distribution,
                                  const std::vector<std::array<int64_t, n>>& elements, int rank,
                                  int64_t& owned, const std::vector<char>& surrounded = {}) {
  constexpr int64_t points_in_block = 1024;
  const int64_t blocks = distribution.total_points / points_in_block + 1;
  const auto block_of = [&](const std::array<int64_t, n>& element) {
    const bool mine = distribution.owner[element[0]] == rank;
    const bool near =
        !surrounded.empty() &&
        std::any_of(element.begin(), element.end(), [&](int64_t p) { return surrounded[p] != 0; });
    if (!mine && !near && !touches(distribution, element, rank)) return 2 * blocks;
    int64_t first = distribution.place[element[0]];
    for (const int64_t point : element) first = std::min(first, distribution.place[point]);
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

void pick_points(const Distribution& distribution, Part& part) {
  const model::Points& all = distribution.model.points;
  model::Points& mine = part.model.points;
  mine.position = pick(all.position, part.point_row);
  mine.set = pick(distribution.set, part.point_row);
  part.original_set = pick(all.set, std::span(part.point_row).first(part.owned_points));
  mine.target = pick(all.target, part.point_row);
  mine.layer = pick(all.layer, part.point_row);
  mine.column = pick(all.column, part.point_row);
  mine.bone = pick(all.bone, part.point_row);
  mine.mass = pick(all.mass, part.point_row);
  mine.external_force = pick(all.external_force, part.point_row);
  part.unknown = pick(distribution.unknown, part.point_row);
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
model::Contact pick_contact(const Distribution& distribution, LocalNumbers& local, int rank,
                            std::vector<int64_t>& pair_row) {
  const model::Contact& all = distribution.model.contact;
  const auto mine = [&](const std::vector<int64_t>& points) {
    std::vector<int64_t> rows;
    for (size_t c = 0; c < points.size(); ++c)
      if (distribution.owner[points[c]] == rank && distribution.unknown[points[c]] >= 0)
        rows.push_back(static_cast<int64_t>(c));
    return rows;
  };
  const auto number_all = [&](std::vector<int64_t>& points) {
    for (int64_t& point : points) point = local.of(point);
  };
  model::Contact part{all.stiffness, all.spacing, {}, {}, {}};
  const std::vector<int64_t>& rows = pair_row = mine(all.pairs.point);
  part.pairs = {pick(all.pairs.point, rows), pick(all.pairs.body, rows),
                pick(all.pairs.binding, rows), pick(all.pairs.area, rows),
                pick(distribution.contact_offset, rows)};
  number_all(part.pairs.point);
  if (all.cut_faces.empty() || distribution.owner[all.cut_faces.point.front()] != rank) return part;
  part.cut_faces = all.cut_faces;
  number_all(part.cut_faces.point);
  return part;
}

void pick_springs(const Distribution& distribution, LocalNumbers& local, int rank, Part& part) {
  const Model& model = distribution.model;
  auto rows = element_rows(distribution, model.springs.points, rank, part.owned_springs);
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
void pick_solid(const Distribution& distribution, LocalNumbers& local, int rank, Part& part) {
  const Model& model = distribution.model;
  std::vector<char> surrounded;
  if (model::is_solid(model)) surrounded = surrounded_points(distribution, rank);
  auto rows = element_rows(distribution, model.prisms.points, rank, part.owned_prisms, surrounded);
  part.model.prisms = model::pick_prisms(model.prisms, rows);
  number(part.model.prisms.points, local);
  rows.resize(part.owned_prisms);
  part.prism_row = std::move(rows);
  rows = element_rows(distribution, model.edges.points, rank, part.owned_edges);
  part.model.edges = {pick_elements(model.edges.points, rows, local),
                      pick(model.edges.weight, rows)};
  rows.resize(part.owned_edges);
  part.edge_row = std::move(rows);
}

/// Those of further terms that a rank owns the first point of, or an unknown.
model::TermElements pick_elements(const Distribution& distribution, const model::TermElements& all,
                                  LocalNumbers& local, int rank) {
  model::TermElements mine{all.term, all.points_each, all.numbers_each, {}, {}};
  for (size_t e = 0; e < all.size(); ++e) {
    const auto points = all.points_of(e);
    const auto numbers = all.numbers_of(e);
    if (distribution.owner[points[0]] != rank && !touches(distribution, points, rank)) continue;
    for (const int64_t point : points) mine.points.push_back(local.of(point));
    mine.numbers.insert(mine.numbers.end(), numbers.begin(), numbers.end());
  }
  return mine;
}

}  // namespace

Part make_part(const Distribution& distribution, const OwnedRange& owned, LocalNumbers& local) {
  const Model& model = distribution.model;
  const int rank = owned.rank;
  Part part;
  part.owned_points = static_cast<int64_t>(owned.points.size());
  for (const int64_t row : owned.points) local.of(row);
  pick_springs(distribution, local, rank, part);
  pick_solid(distribution, local, rank, part);
  for (const model::TermElements& elements : model.elements)
    part.model.elements.push_back(pick_elements(distribution, elements, local, rank));
  part.model.contact = pick_contact(distribution, local, rank, part.pair_row);
  part.contact = !model.contact.empty();
  part.bodies = distribution.bodies;
  if (!distribution.bodies.empty()) part.body_meshes = body_meshes(model);
  part.point_row = local.release();
  pick_points(distribution, part);
  part.solid = model::is_solid(model);
  part.model.gravity = model.gravity;
  part.model.bones = model.bones;
  part.model.bone_transform = distribution.bone_transform;
  part.first_unknown = owned.first_unknown;
  part.owned_unknowns = owned.unknowns;
  part.total_points = distribution.total_points;
  part.total_springs = static_cast<int64_t>(model.springs.points.size());
  part.total_prisms = static_cast<int64_t>(model.prisms.points.size());
  part.total_unknowns = distribution.total_unknowns;
  return part;
}

}  // namespace repose::discrete
