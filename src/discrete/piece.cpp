#include "piece.h"

#include <algorithm>
#include <numeric>

#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/discrete/natural_rows.h"
#include "repose/model/motion.h"

namespace repose::discrete {

using base::pick;
using model::Model;
using model::PointSet;

BoneMotions bone_motions(const Model& model) {
  const model::PrescribedMotion motion(model);
  BoneMotions motions;
  for (int32_t b = 0; b < static_cast<int32_t>(model.bones.size()); ++b) {
    motions.transform.push_back(motion.bone_matrix(b, 1.0));
    motions.straight.push_back(motion.straight(b));
  }
  return motions;
}

namespace {

/// Gives local numbers to rows as they are met, owned points first.
class LocalNumbers {
 public:
  explicit LocalNumbers(size_t rows) : local_(rows, -1) {}
  int64_t of(int64_t row) {
    if (local_[row] < 0) {
      local_[row] = static_cast<int64_t>(rows_.size());
      rows_.push_back(row);
    }
    return local_[row];
  }
  const std::vector<int64_t>& rows() const { return rows_; }

 private:
  std::vector<int64_t> local_, rows_;
};

bool touches(const Piece& piece, std::span<const int64_t> element, int rank) {
  return std::any_of(element.begin(), element.end(), [&](int64_t row) {
    return piece.owner[row] == rank && piece.unknown[row] >= 0;
  });
}

/// [N] Points around which one rank has all prisms of a solid: its own, because those of an edge
/// say how stiff it is (solve/prestress.h), and where volumes are averaged those of the prisms at
/// its unknowns.
std::vector<char> surrounded_points(const Piece& piece, int rank) {
  std::vector<char> surrounded(piece.owner.size(), 0);
  for (size_t row = 0; row < surrounded.size(); ++row) surrounded[row] = piece.owner[row] == rank;
  if (piece.model.prisms.nodal_modulus.empty()) return surrounded;
  for (const auto& prism : piece.model.prisms.points)
    if (piece.owner[prism[0]] == rank || touches(piece, prism, rank))
      for (const int64_t row : prism) surrounded[row] = 1;
  return surrounded;
}

/// Rows of the elements of one rank: those whose first point it owns, then those it also needs.
/// Both in blocks by where their first met point is, within a block as before: a loop then works on
/// points that fit into the cache together.
template <size_t n>
std::vector<int64_t> element_rows(const Piece& piece,
                                  const std::vector<std::array<int64_t, n>>& elements, int rank,
                                  int64_t& owned, const std::vector<char>& surrounded = {}) {
  constexpr int64_t points_in_block = 1024;
  const int64_t blocks = piece.counts.points / points_in_block + 1;
  const auto block_of = [&](const std::array<int64_t, n>& element) {
    const bool mine = piece.owner[element[0]] == rank;
    const bool near =
        !surrounded.empty() &&
        std::any_of(element.begin(), element.end(), [&](int64_t p) { return surrounded[p] != 0; });
    if (!mine && !near && !touches(piece, element, rank)) return 2 * blocks;
    int64_t first = piece.place[element[0]];
    for (const int64_t point : element) first = std::min(first, piece.place[point]);
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

void pick_points(Piece& piece, Part& part) {
  model::Points& mine = part.model.points;
  mine = pick_rows(std::move(piece.model.points), part.point_row);
  part.unknown = pick(piece.unknown, part.point_row);
  part.original_set.assign(mine.set.begin(), mine.set.begin() + part.owned_points);
  for (size_t p = 0; p < mine.set.size(); ++p)
    if (mine.set[p] == PointSet::bone && piece.bones.straight[mine.bone[p]])
      mine.set[p] = PointSet::held;
}

/// [bodies] Triangles of the model's bodies at load 0; empty for closed forms.
std::vector<surface::Surface> body_meshes(const Model& model) {
  std::vector<surface::Surface> meshes;
  for (const model::Body& body : model.contact.bodies) {
    const surface::Surface* mesh = mechanics::mesh_of(model, body);
    meshes.push_back(mesh ? *mesh : surface::Surface{});
  }
  return meshes;
}

/// The constraints of the points that a rank owns.
model::Contact pick_contact(const Piece& piece, const std::vector<double>& offset, int rank,
                            std::vector<int64_t>& pair_row) {
  const model::Contact& all = piece.model.contact;
  const auto mine = [&](const std::vector<int64_t>& points) {
    std::vector<int64_t> rows;
    for (size_t c = 0; c < points.size(); ++c)
      if (piece.owner[points[c]] == rank && piece.unknown[points[c]] >= 0)
        rows.push_back(static_cast<int64_t>(c));
    return rows;
  };
  model::Contact part{all.stiffness, all.spacing, {}, {}, {}};
  const std::vector<int64_t>& rows = pair_row = mine(all.pairs.point);
  part.pairs = pick_rows(all.pairs, rows);
  part.pairs.offset = pick(offset, rows);
  if (all.cut_faces.empty() || piece.owner[all.cut_faces.point.front()] != rank) return part;
  part.cut_faces = all.cut_faces;
  return part;
}

void pick_springs(Piece& piece, int rank, Part& part) {
  Model& model = piece.model;
  auto rows = element_rows(piece, model.springs.points, rank, part.owned_springs);
  part.model.springs = pick_rows(std::move(model.springs), rows);
  rows.resize(part.owned_springs);
  part.spring_row = pick(piece.spring_row, rows);
}

/// Prisms, and edges.
void pick_solid(Piece& piece, int rank, Part& part) {
  Model& model = piece.model;
  std::vector<char> surrounded;
  if (model::is_solid(model)) surrounded = surrounded_points(piece, rank);
  auto rows = element_rows(piece, model.prisms.points, rank, part.owned_prisms, surrounded);
  part.model.prisms = pick_rows(std::move(model.prisms), rows);
  rows.resize(part.owned_prisms);
  part.prism_row = pick(piece.prism_row, rows);
  rows = element_rows(piece, model.edges.points, rank, part.owned_edges);
  part.model.edges = pick_rows(std::move(model.edges), rows);
  rows.resize(part.owned_edges);
  part.edge_row = pick(piece.edge_row, rows);
}

/// Those of further terms that a rank owns the first point of, or an unknown.
model::TermElements pick_elements(const Piece& piece, const model::TermElements& all, int rank) {
  model::TermElements mine{all.term, all.points_each, all.numbers_each, {}, {}, all.bone_number};
  for (size_t e = 0; e < all.size(); ++e) {
    const auto points = all.points_of(e);
    if (piece.owner[points[0]] == rank || touches(piece, points, rank))
      mine.add(points, all.numbers_of(e));
  }
  return mine;
}

std::vector<int64_t> own_points(const Piece& piece, int rank) {
  std::vector<int64_t> rows;
  for (size_t i = 0; i < piece.owner.size(); ++i)
    if (piece.owner[i] == rank) rows.push_back(static_cast<int64_t>(i));
  std::ranges::sort(rows, {}, [&](int64_t row) { return piece.place[row]; });
  return rows;
}

/// The bodies, where any rank has contact, and the constraints. Collective.
void add_contact(MPI_Comm comm, const Piece& piece, Part& part) {
  const Model& model = piece.model;
  part.contact = base::on_any_rank(comm, !model.contact.empty());
  if (part.contact)
    base::collective_try(comm, [&] { part.bodies = mechanics::make_bodies(model); });
  part.model.contact = pick_contact(piece, mechanics::contact_offsets(model, part.bodies),
                                    base::rank(comm), part.pair_row);
  if (!part.bodies.empty()) part.body_meshes = body_meshes(model);
}

/// Takes points and elements out of `piece`. Collective.
Part make_part(MPI_Comm comm, Piece& piece, const std::vector<int64_t>& own) {
  const Model& model = piece.model;
  const int rank = base::rank(comm);
  Part part;
  part.owned_points = static_cast<int64_t>(own.size());
  pick_springs(piece, rank, part);
  pick_solid(piece, rank, part);
  for (const model::TermElements& elements : model.elements)
    part.model.elements.push_back(pick_elements(piece, elements, rank));
  add_contact(comm, piece, part);
  LocalNumbers local(piece.owner.size());
  for (const int64_t row : own) local.of(row);
  for_each_point(part.model, [&](int64_t& point) { point = local.of(point); });
  part.point_row = local.rows();
  pick_points(piece, part);
  part.point_row = pick(piece.point_row, part.point_row);
  part.solid = piece.solid;
  part.model.gravity = model.gravity;
  part.model.bones = model.bones;
  part.model.bone_transform = piece.bones.transform;
  part.unknowns = piece.unknowns;
  part.total_points = piece.counts.points;
  part.total_springs = piece.counts.springs;
  part.total_prisms = piece.counts.prisms;
  return part;
}

void count_points(MPI_Comm comm, const Part& part, model::Counts& counts) {
  int64_t of[4] = {};
  for (const PointSet set : part.original_set) ++of[static_cast<int>(set)];
  MPI_Allreduce(MPI_IN_PLACE, of, 4, MPI_INT64_T, MPI_SUM, comm);
  counts.soft = of[0], counts.boundary = of[1], counts.bone = of[2], counts.held = of[3];
}

}  // namespace

void copy_surfaces(const base::Message& copy, std::vector<surface::Surface>& surfaces) {
  auto count = surfaces.size();
  copy(count);
  surfaces.resize(count);
  for (surface::Surface& of : surfaces) copy(of.points, of.triangles);
}

UnknownBlocks unknown_blocks(const std::vector<int64_t>& begin, int rank) {
  return {begin[rank], begin[rank + 1] - begin[rank], begin.back()};
}

LocalModel build_part(MPI_Comm comm, Piece& piece) {
  const std::vector<int64_t> own = own_points(piece, base::rank(comm));
  const std::vector<Vec3> outward = pick(model::outward_normals(piece.model), own);
  LocalModel local_model;
  local_model.part = make_part(comm, piece, own);
  local_model.outward = NaturalRows(comm, local_model.part).natural(outward);
  local_model.counts = piece.counts;
  count_points(comm, local_model.part, local_model.counts);
  return local_model;
}

}  // namespace repose::discrete
