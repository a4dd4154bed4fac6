#include "repose/discrete/part.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "countable.h"
#include "exchange.h"
#include "partition.h"
#include "piece.h"
#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::Model;
using model::PointSet;
using RowsOfRanks = std::vector<std::vector<int64_t>>;  // [ranks] rows that each receives

/// Owners and numbers of all points, on rank 0.
struct Numbers {
  std::vector<int64_t> column;  // [N] 0-based, consecutive, in order of first appearance
  int64_t columns = 0;
  std::vector<int> owner;               // [N]
  std::vector<int64_t> order;           // [N] rows by their places
  std::vector<int64_t> place, unknown;  // [N] as in Piece
  std::vector<int64_t> unknown_begin;   // [ranks + 1]
};

void number_columns(const std::vector<int64_t>& names, Numbers& numbers) {
  std::unordered_map<int64_t, int64_t> number;
  numbers.column.reserve(names.size());
  for (const int64_t name : names)
    numbers.column.push_back(
        number.emplace(name, static_cast<int64_t>(number.size())).first->second);
  numbers.columns = static_cast<int64_t>(number.size());
}

void number_points(const ColumnGraph& graph, const std::vector<PointSet>& set, int ranks,
                   Numbers& numbers) {
  const auto n = static_cast<int64_t>(set.size());
  numbers.order = base::all_rows(n);
  const std::vector<int64_t> column = pick(memory_order(graph), numbers.column);
  std::stable_sort(numbers.order.begin(), numbers.order.end(), [&](int64_t a, int64_t b) {
    return std::pair(numbers.owner[a], column[a]) < std::pair(numbers.owner[b], column[b]);
  });
  numbers.place.resize(n);
  numbers.unknown.assign(n, -1);
  numbers.unknown_begin.assign(ranks + 1, 0);
  int64_t next = 0;
  for (int64_t k = 0; k < n; ++k) {
    const int64_t row = numbers.order[k];
    numbers.place[row] = k;
    if (set[row] == PointSet::soft_tissue) numbers.unknown[row] = next++;
    numbers.unknown_begin[numbers.owner[row] + 1] = next;
  }
  for (int r = 0; r < ranks; ++r)
    numbers.unknown_begin[r + 1] = std::max(numbers.unknown_begin[r + 1], numbers.unknown_begin[r]);
}

/// The columns along cuts whose sides may meet go to one rank.
void keep_cuts_whole(const Model& model, Numbers& numbers) {
  const std::vector<int64_t>& points = model.contact.cut_faces.point;
  if (points.empty()) return;
  std::vector<char> moves(numbers.columns, 0);
  for (const int64_t point : points) moves[numbers.column[point]] = 1;
  const int owner = numbers.owner[points.front()];
  for (size_t p = 0; p < numbers.owner.size(); ++p)
    if (moves[numbers.column[p]]) numbers.owner[p] = owner;
}

/// Removes contact's pairs of points that are not free to move.
void remove_fixed_pairs(const std::vector<PointSet>& set, Model& model) {
  model::ContactPairs& pairs = model.contact.pairs;
  std::vector<int64_t> free;
  for (size_t c = 0; c < pairs.point.size(); ++c)
    if (set[pairs.point[c]] == PointSet::soft_tissue) free.push_back(static_cast<int64_t>(c));
  pairs = pick_rows(std::move(pairs), free);
}

/// The ranks that need the elements of each column: those that own it or a column beside it.
struct ColumnRanks {
  std::vector<int64_t> begin;  // [columns + 1]
  std::vector<int> rank;
};

ColumnRanks ranks_of_columns(const ColumnGraph& graph, const Numbers& numbers) {
  std::vector<int> owner(graph.columns());
  for (size_t p = 0; p < numbers.owner.size(); ++p) owner[numbers.column[p]] = numbers.owner[p];
  ColumnRanks ranks{{0}, {}};
  for (int64_t c = 0; c < graph.columns(); ++c) {
    const auto first = static_cast<int64_t>(ranks.rank.size());
    ranks.rank.push_back(owner[c]);
    for (int64_t k = graph.row_begin[c]; k < graph.row_begin[c + 1]; ++k)
      ranks.rank.push_back(owner[graph.neighbor[k]]);
    std::sort(ranks.rank.begin() + first, ranks.rank.end());
    ranks.rank.erase(std::unique(ranks.rank.begin() + first, ranks.rank.end()), ranks.rank.end());
    ranks.begin.push_back(static_cast<int64_t>(ranks.rank.size()));
  }
  return ranks;
}

/// Columns of the points of the elements that this rank holds.
class HeldColumns {
 public:
  HeldColumns(MPI_Comm comm, const Model& held, const Numbers& numbers)
      : index_(base::sum_over_ranks(comm, held.points.position.size())) {
    for_each_point(held, [&](int64_t point) { index_.add(point); });
    column_ = Exchange::fetch(comm, index_.sort(),
                              static_cast<int64_t>(numbers.column.size()))(numbers.column);
  }
  int64_t of(int64_t point) const { return column_[index_.place(point)]; }

 private:
  RowIndex index_;
  std::vector<int64_t> column_;
};

/// The graph of all columns, on rank 0. Collective.
ColumnGraph gather_graph(MPI_Comm comm, const Model& held, const HeldColumns& column,
                         int64_t columns) {
  base::broadcast(comm, columns);
  const ColumnGraph mine = column_graph(columns, [&](const auto& link) {
    const auto join = [&](int64_t p, int64_t q) {
      const int64_t c = column.of(p), d = column.of(q);
      if (c != d) link(c, d), link(d, c);
    };
    for (const auto& [p, q] : held.springs.points) join(p, q);
    for (const auto& [p, q] : held.edges.points) join(p, q);
    for (const auto& corners : held.prisms.points)
      for (int c = 1; c < 6; ++c) join(corners[0], corners[c]);
  });
  if (base::size(comm) == 1) return mine;
  std::vector<std::array<int64_t, 2>> links;
  for (int64_t c = 0; c < columns; ++c)
    for (int64_t k = mine.row_begin[c]; k < mine.row_begin[c + 1]; ++k)
      links.push_back({c, mine.neighbor[k]});
  links = base::gather(comm, std::move(links));
  return column_graph(base::rank(comm) == 0 ? columns : 0, [&](const auto& link) {
    for (const auto& [c, d] : links) link(c, d);
  });
}

/// Sends the elements that ranks hold to those that need them.
class ElementExchange {
  static std::span<const int64_t> points_of(std::span<const int64_t> points) { return points; }
  static std::span<const int64_t> points_of(const int64_t& point) { return {&point, 1}; }

 public:
  ElementExchange(MPI_Comm comm, const ColumnRanks& needing, const HeldColumns& column)
      : comm_(comm), needing_(needing), column_(column) {}

  /// Replaces a group of arrays whose elements have these `points`; returns their rows in the
  /// whole model. Collective.
  template <class Group, class Points>
  std::vector<int64_t> operator()(const Points& points, Group& group) const {
    const Exchange exchange(comm_, rows(points));
    std::vector<int64_t> row(points.size());
    std::iota(row.begin(), row.end(), base::count_before(comm_, row.size()));
    row = exchange(row);
    model::for_each_array(group, [&](const char*, auto& values) { values = exchange(values); });
    return row;
  }
  void operator()(std::vector<Triangle>& triangles) const {
    triangles = Exchange(comm_, rows(triangles))(triangles);
  }
  void operator()(model::TermElements& elements) const {
    std::vector<std::span<const int64_t>> points;
    for (size_t e = 0; e < elements.size(); ++e) points.push_back(elements.points_of(e));
    const RowsOfRanks each = rows(points);
    elements.points = Exchange(comm_, blocks(each, elements.points_each))(elements.points);
    elements.numbers = Exchange(comm_, blocks(each, elements.numbers_each))(elements.numbers);
  }

 private:
  template <class Points>
  RowsOfRanks rows(const Points& elements) const {
    RowsOfRanks rows(base::size(comm_));
    for (size_t e = 0; e < elements.size(); ++e)
      for (const int64_t point : points_of(elements[e])) {
        const int64_t c = column_.of(point);
        for (int64_t k = needing_.begin[c]; k < needing_.begin[c + 1]; ++k) {
          std::vector<int64_t>& to_rank = rows[needing_.rank[k]];
          if (to_rank.empty() || to_rank.back() != static_cast<int64_t>(e))
            to_rank.push_back(static_cast<int64_t>(e));
        }
      }
    return rows;
  }
  /// Rows of arrays with so many values an element.
  static RowsOfRanks blocks(const RowsOfRanks& each, int64_t values) {
    RowsOfRanks all(each.size());
    for (size_t r = 0; r < each.size(); ++r)
      for (const int64_t e : each[r])
        for (int64_t k = 0; k < values; ++k) all[r].push_back(values * e + k);
    return all;
  }
  MPI_Comm comm_;
  const ColumnRanks& needing_;
  const HeldColumns& column_;
};

/// Copies what is neither point nor spring, prism, edge nor pair of contact.
Model copy_metadata(Model& model) {
  Model rows;
  const auto swap_rows = [&] {
    std::swap(model.points, rows.points);
    std::swap(model.springs, rows.springs);
    std::swap(model.prisms, rows.prisms);
    std::swap(model.edges, rows.edges);
    std::swap(model.contact.pairs, rows.contact.pairs);
  };
  swap_rows();
  Model metadata = model;
  swap_rows();
  return metadata;
}

/// Returns the motion of the bones, on all ranks. Collective.
BoneMotions gather_motions(MPI_Comm comm, const Model& held) {
  std::vector<int64_t> rows;
  for (size_t p = 0; p < held.points.set.size(); ++p)
    if (held.points.set[p] == PointSet::bone) rows.push_back(static_cast<int64_t>(p));
  Model carried;
  carried.bones = held.bones;
  carried.bone_transform = held.bone_transform;
  carried.points.position = base::gather(comm, pick(held.points.position, rows));
  carried.points.set = base::gather(comm, pick(held.points.set, rows));
  carried.points.target = base::gather(comm, pick(held.points.target, rows));
  carried.points.bone = base::gather(comm, pick(held.points.bone, rows));
  BoneMotions motions;
  base::on_root(comm, [&] { motions = bone_motions(carried); });
  base::broadcast(comm, motions.transform, motions.straight);
  return motions;
}

/// Copies bodies; their names stay behind.
void copy_bodies(const base::Message& copy, std::vector<model::Body>& bodies) {
  auto count = bodies.size();
  copy(count);
  bodies.resize(count);
  const Vec3 zero = Vec3::Zero();
  const model::Body::Shape kinds[] = {scene::Sphere{zero, 0}, scene::Capsule{zero, zero, 0},
                                      scene::Box{zero, zero}, scene::HalfSpace{zero, zero},
                                      surface::Surface{}};
  for (model::Body& body : bodies) {
    auto kind = static_cast<int64_t>(body.shape.index());
    copy(body.bone, body.push, kind);
    if (kind != static_cast<int64_t>(body.shape.index())) body.shape = kinds[kind];
    std::visit(
        [&](auto& shape) {
          if constexpr (requires { shape.triangles; })
            copy(shape.points, shape.triangles);
          else
            copy(shape);
        },
        body.shape);
  }
}

/// Gives all ranks what rank 0 alone holds of a model and each needs, in the rows of the whole.
/// Collective.
void share_globals(MPI_Comm comm, bool averaged, const Numbers& numbers, Piece& piece) {
  Model& m = piece.model;
  model::CutFaces& faces = m.contact.cut_faces;
  int cut_owner = faces.empty() ? 0 : numbers.owner[faces.point.front()];
  const base::Message share(comm, 0);
  auto bones = static_cast<int64_t>(m.bones.size()),
       terms = static_cast<int64_t>(m.elements.size());
  share(bones, terms, cut_owner, m.gravity, m.contact.stiffness, m.contact.spacing);
  m.bones.resize(bones);
  m.elements.resize(terms);
  for (model::TermElements& elements : m.elements) {
    share(elements.term, elements.points_each, elements.numbers_each, elements.bone_number);
  }
  copy_bodies(share, m.contact.bodies);
  if (m.contact.bodies.empty()) m.bone_surfaces.clear();
  copy_surfaces(share, m.bone_surfaces);
  share(faces.size, faces.begin, faces.point, faces.weight, faces.area);
  if (base::rank(comm) != cut_owner) faces = {};
  // Arrays of one row make ranks without prisms take part in all that others have.
  if (piece.solid && m.prisms.modulus.empty()) m.prisms.modulus.resize(1);
  if (averaged && m.prisms.nodal_modulus.empty()) m.prisms.nodal_modulus.resize(1);
}

/// Sends all elements to the ranks that need them. Returns the rows of contact's pairs. Collective.
std::vector<int64_t> exchange_elements(const ElementExchange& exchange, Piece& piece) {
  Model& m = piece.model;
  piece.spring_row = exchange(m.springs.points, m.springs);
  piece.prism_row = exchange(m.prisms.points, m.prisms);
  piece.edge_row = exchange(m.edges.points, m.edges);
  exchange(m.skin);
  for (model::TermElements& elements : m.elements) exchange(elements);
  return exchange(m.contact.pairs.point, m.contact.pairs);
}

/// Fetches the points that the rank owns and those of its elements, and numbers these. Collective.
void fetch_points(MPI_Comm comm, const Numbers& numbers, Piece& piece) {
  RowsOfRanks places(base::size(comm));
  for (size_t k = 0; k < numbers.order.size(); ++k)
    places[numbers.owner[numbers.order[k]]].push_back(static_cast<int64_t>(k));
  RowIndex index(piece.counts.points);
  for (const int64_t row : Exchange(comm, places)(numbers.order)) index.add(row);
  for_each_point(piece.model, [&](int64_t point) { index.add(point); });
  piece.point_row = index.sort();
  for_each_point(piece.model, [&](int64_t& point) { point = index.place(point); });
  model::Points& points = piece.model.points;
  const auto held = static_cast<int64_t>(points.position.size());
  const Exchange fetched = Exchange::fetch(comm, piece.point_row, held);
  model::for_each_array(points, [&](const char*, auto& values) { values = fetched(values); });
  const auto numbered = static_cast<int64_t>(numbers.owner.size());
  const Exchange given = Exchange::fetch(comm, piece.point_row, numbered);
  piece.owner = given(numbers.owner);
  piece.place = given(numbers.place);
  piece.unknown = given(numbers.unknown);
}

/// Assigns the points to ranks, and to `piece` its unknowns. Returns the ranks that need each
/// column. Collective.
ColumnRanks assign(MPI_Comm comm, const HeldColumns& column, const std::vector<PointSet>& set,
                   Numbers& numbers, Piece& piece) {
  ColumnGraph graph = gather_graph(comm, piece.model, column, numbers.columns);
  graph.weight.assign(numbers.columns, 1);
  for (size_t p = 0; p < set.size(); ++p)
    if (set[p] == PointSet::soft_tissue) ++graph.weight[numbers.column[p]];
  const std::vector<int> owner = partition(comm, graph);
  ColumnRanks needing;
  base::on_root(comm, [&] {
    numbers.owner = pick(owner, numbers.column);
    keep_cuts_whole(piece.model, numbers);
    number_points(graph, set, base::size(comm), numbers);
    needing = ranks_of_columns(graph, numbers);
  });
  base::broadcast(comm, needing.begin, needing.rank, numbers.unknown_begin);
  piece.unknowns = unknown_blocks(numbers.unknown_begin, base::rank(comm));
  return needing;
}

void count_rows(MPI_Comm comm, Piece& piece) {
  const Model& held = piece.model;
  piece.counts.points = base::sum_over_ranks(comm, held.points.position.size());
  piece.counts.springs = base::sum_over_ranks(comm, held.springs.points.size());
  piece.counts.prisms = base::sum_over_ranks(comm, held.prisms.points.size());
  piece.counts.edges = base::sum_over_ranks(comm, held.edges.points.size());
  piece.solid = base::sum_over_ranks(comm, held.prisms.modulus.size()) > 0;
}

/// Makes of the rows that this rank holds the piece that it needs. Returns the rows of contact's
/// pairs, and the model's global metadata on rank 0. Collective.
std::vector<int64_t> exchange_rows(MPI_Comm comm, Piece& piece, Model& global_metadata) {
  Model& held = piece.model;
  const bool averaged = base::sum_over_ranks(comm, held.prisms.nodal_modulus.size()) > 0;
  const std::vector<int64_t> names = base::gather(comm, held.points.column);
  const std::vector<PointSet> set = base::gather(comm, held.points.set);
  Numbers numbers;
  base::on_root(comm, [&] {
    require_countable(piece.counts.points);
    number_columns(names, numbers);
    remove_fixed_pairs(set, held);
  });
  const HeldColumns column(comm, held, numbers);
  const ColumnRanks needing = assign(comm, column, set, numbers, piece);
  piece.bones = gather_motions(comm, held);
  global_metadata = copy_metadata(held);
  if (held.bone_transform.empty() && !std::ranges::count(piece.bones.straight, true))
    global_metadata.bone_transform = piece.bones.transform;  // there are no points to find it by
  share_globals(comm, averaged, numbers, piece);
  std::vector<int64_t> pair_row = exchange_elements(ElementExchange(comm, needing, column), piece);
  fetch_points(comm, numbers, piece);
  return pair_row;
}

}  // namespace

LocalModel build_local(MPI_Comm comm, Model&& rows) {
  static const PetscLogEvent event = base::log_event("RpPartition");
  const base::Logged logged(event);
  Piece piece;
  piece.model = std::move(rows);
  count_rows(comm, piece);
  Model global_metadata;
  const std::vector<int64_t> pair_row = exchange_rows(comm, piece, global_metadata);
  LocalModel local_model = build_part(comm, piece);
  local_model.part.pair_row = pick(pair_row, local_model.part.pair_row);
  local_model.contact_pairs = base::sum_over_ranks(comm, local_model.part.pair_row.size());
  local_model.global_metadata = std::move(global_metadata);
  return local_model;
}

LocalModel build_local_from_root(MPI_Comm comm, Model model) {
  return build_local(comm, base::rank(comm) == 0 ? std::move(model) : Model());
}

}  // namespace repose::discrete
