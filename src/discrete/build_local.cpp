#include <algorithm>
#include <map>
#include <numeric>

#include "exchange.h"
#include "piece.h"
#include "rank_columns.h"
#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"
#include "repose/discrete/natural_rows.h"
#include "repose/discrete/part.h"

namespace repose::discrete {

namespace {

using base::pick;
using model::PointSet;

/// Rows in a list of the whole model that is sorted by column.
struct ColumnRows {
  std::vector<int64_t> row;
  int64_t total = 0;
};

/// [columns] on rank 0 the values of all ranks' own columns; collective.
template <class Value>
std::vector<Value> gather_by_column(MPI_Comm comm, int64_t columns, const std::vector<int64_t>& own,
                                    const std::vector<Value>& values) {
  const std::vector<int64_t> column = base::gather(comm, own);
  const std::vector<Value> value = base::gather(comm, values);
  std::vector<Value> all(base::rank(comm) == 0 ? columns : 0);
  for (size_t k = 0; k < column.size(); ++k) all[column[k]] = value[k];
  return all;
}

/// Returns the global rows of items; `column` [items] is ascending. The items of a column count on
/// one rank, where they are `owned` [items], and may be known on others. O(all columns) on rank 0.
/// Collective.
ColumnRows rows_by_column(MPI_Comm comm, int64_t columns, const std::vector<int64_t>& column,
                          const std::vector<char>& owned) {
  std::vector<int64_t> known, own, count;
  for (size_t i = 0; i < column.size(); ++i) {
    const int64_t c = column[i];
    if (known.empty() || known.back() != c) known.push_back(c);
    if (!owned[i]) continue;
    if (own.empty() || own.back() != c) own.push_back(c), count.push_back(0);
    ++count.back();
  }
  std::vector<int64_t> first = gather_by_column(comm, columns + 1, own, count);
  if (base::rank(comm) == 0) std::exclusive_scan(first.begin(), first.end(), first.begin(), 0L);
  const std::vector<int64_t> begin = Exchange::fetch(comm, known, std::ssize(first))(first);
  ColumnRows rows;
  if (base::rank(comm) == 0) rows.total = first.back();
  base::broadcast(comm, rows.total);
  size_t k = 0;
  int64_t next = 0;
  for (const int64_t c : column) {
    if (known[k] != c) ++k, next = 0;
    rows.row.push_back(begin[k] + next++);
  }
  return rows;
}

/// The model of a rank's piece; refuses regions that hold no prism of any.
/// Collective.
model::Model build_piece(MPI_Comm comm, const scene::Scene& scene,
                         const std::vector<surface::Surface>& bones, const model::Piece& piece) {
  model::Model model;
  std::vector<int64_t> found;
  base::collective_try(comm, [&] { model = model::build_local(scene, bones, piece, found); });
  MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_INT64_T, MPI_SUM,
                comm);
  base::on_root(comm, [&] { model::require_regions(found, scene.file.string()); });
  return model;
}

/// Removes terms that have no element on any rank. Collective.
void remove_empty_terms(MPI_Comm comm, model::Model& model) {
  std::vector<int64_t> elements;  // as many on all ranks
  for (const model::TermElements& of : model.elements)
    elements.push_back(static_cast<int64_t>(of.size()));
  MPI_Allreduce(MPI_IN_PLACE, elements.data(), static_cast<int>(elements.size()), MPI_INT64_T,
                MPI_MAX, comm);
  for (size_t k = elements.size(); k-- > 0;)
    if (elements[k] == 0) model.elements.erase(model.elements.begin() + static_cast<int64_t>(k));
}

std::vector<int64_t> own_columns(const RankColumns& rank_columns, int rank) {
  std::vector<int64_t> own;
  for (size_t c = 0; c < rank_columns.owner.size(); ++c)
    if (rank_columns.owner[c] == rank) own.push_back(static_cast<int64_t>(c));
  return own;
}

/// Sets contact's stiffness by means over the whole tissue and returns the effective modulus, on
/// rank 0. Collective.
double set_mean_moduli(MPI_Comm comm, const scene::Scene& scene, const RankColumns& rank_columns,
                       model::Model& model) {
  const std::vector<int64_t> own = own_columns(rank_columns, base::rank(comm));
  const auto mine = pick(model::column_sums(model, rank_columns.layers), own);
  const auto sums =
      gather_by_column(comm, rank_columns.columns, pick(rank_columns.piece.column, own), mine);
  double effective_modulus = 0;
  base::on_root(comm, [&] {
    effective_modulus = model::effective_modulus(sums);
    model.contact.stiffness = model::contact_stiffness(scene, sums);
  });
  base::broadcast(comm, model.contact.stiffness);
  return effective_modulus;
}

/// Points of a piece's model whose cuts are made.
struct PiecePoints {
  std::vector<int64_t> column;  // [N] row of the piece's columns
  std::vector<int64_t> place;   // [N] among the points of its column: layers, then doubles
  std::vector<int64_t> row;     // [N] in the whole model
  void add(int64_t piece_column, int64_t place_in_column, int64_t whole_row) {
    column.push_back(piece_column);
    place.push_back(place_in_column);
    row.push_back(whole_row);
  }
};

PiecePoints points_of(const RankColumns& rank_columns) {
  const std::vector<int64_t>& column = rank_columns.piece.column;
  const int64_t layers = rank_columns.layers;
  PiecePoints points;
  for (size_t c = 0; c < column.size(); ++c)
    for (int64_t a = 0; a < layers; ++a)
      points.add(static_cast<int64_t>(c), a, column[c] * layers + a);
  for (const model::DoubledColumn& at : rank_columns.doubled) {
    const auto found = std::ranges::lower_bound(column, at.column);
    if (found == column.end() || *found != at.column) continue;
    for (int64_t a = 0; a < at.points; ++a)
      points.add(found - column.begin(), layers + a, at.first_row + a);
  }
  return points;
}

/// The column of a row of the whole model in a list sorted by rows: doubles make columns of their
/// own after all others.
int64_t list_column(const RankColumns& rank_columns, int64_t row) {
  if (row < rank_columns.columns * rank_columns.layers) return row / rank_columns.layers;
  const auto after =
      std::ranges::upper_bound(rank_columns.doubled, row, {}, &model::DoubledColumn::first_row);
  return rank_columns.columns + (after - rank_columns.doubled.begin()) - 1;
}

int64_t list_columns(const RankColumns& rank_columns) {
  return rank_columns.columns + static_cast<int64_t>(rank_columns.doubled.size());
}

/// By the columns of a piece what is known of its points.
void number_points(const RankColumns& rank_columns, const PiecePoints& points, Piece& piece) {
  std::vector<int64_t> unknown = rank_columns.unknown;
  for (size_t i = 0; i < points.column.size(); ++i) {
    const int64_t c = points.column[i];
    piece.owner.push_back(rank_columns.owner[c]);
    piece.place.push_back(rank_columns.place[c] + points.place[i]);
    const bool soft = piece.model.points.set[i] == PointSet::soft_tissue;
    piece.unknown.push_back(soft ? unknown[c]++ : -1);
  }
  piece.point_row = points.row;
  piece.counts.points = rank_columns.columns * rank_columns.layers;
  for (const model::DoubledColumn& at : rank_columns.doubled) piece.counts.points += at.points;
  piece.unknowns = rank_columns.unknowns;
}

/// Rows of the piece's prisms in the whole model.
std::vector<int64_t> rows_of_prisms(const RankColumns& rank_columns) {
  std::vector<int64_t> rows;
  for (int64_t layer = 0; layer + 1 < rank_columns.layers; ++layer)
    for (const int64_t triangle : rank_columns.piece.triangle)
      rows.push_back(layer * rank_columns.triangles + triangle);
  return rows;
}

/// [C] Marks a rank's columns and those beside them: the piece has all elements at these.
std::vector<char> surrounded_columns(const RankColumns& rank_columns, int rank) {
  std::vector<char> surrounded(rank_columns.owner.size(), 0);
  for (const Triangle& corner : rank_columns.piece.corner)
    if (std::ranges::any_of(corner, [&](int64_t c) { return rank_columns.owner[c] == rank; }))
      for (const int64_t c : corner) surrounded[c] = 1;
  return surrounded;
}

/// Rows in the whole model of the piece's edges that begin in a surrounded column, −1 of others.
/// Collective.
ColumnRows rows_of_edges(MPI_Comm comm, int rank, const RankColumns& rank_columns,
                         const PiecePoints& points, const model::Model& model) {
  const std::vector<char> surrounded = surrounded_columns(rank_columns, rank);
  std::vector<int64_t> known, column;
  std::vector<char> owned;
  for (size_t e = 0; e < model.edges.points.size(); ++e) {
    const int64_t first = model.edges.points[e][0];
    if (!surrounded[points.column[first]]) continue;
    known.push_back(static_cast<int64_t>(e));
    column.push_back(list_column(rank_columns, points.row[first]));
    owned.push_back(rank_columns.owner[points.column[first]] == rank);
  }
  const ColumnRows rows = rows_by_column(comm, list_columns(rank_columns), column, owned);
  ColumnRows all{std::vector<int64_t>(model.edges.points.size(), -1), rows.total};
  for (size_t k = 0; k < known.size(); ++k) all.row[known[k]] = rows.row[k];
  return all;
}

/// Rows in the whole model of the piece's springs, whose sets are sorted by edges or columns of the
/// skin (make_layers); the halves of a parted spring follow one another. Collective.
ColumnRows rows_of_springs(MPI_Comm comm, int rank, const RankColumns& rank_columns,
                           const PiecePoints& points, const model::Springs& springs) {
  const model::Piece& piece = rank_columns.piece;
  const int64_t layers = rank_columns.layers;
  ColumnRows all;
  size_t j = 0;
  for (int64_t set = 0; set < 3 * layers - 2; ++set) {
    const bool connects = set >= layers && set < 2 * layers - 1;
    const int64_t each = set < 2 * layers - 1 ? 1 : 2;  // diagonals of an edge
    const std::vector<int64_t>& number = connects ? piece.column : piece.edge;
    std::vector<int64_t> place;
    std::vector<char> owned;
    std::array<int64_t, 2> before = {-1, -1};
    int64_t k = -1;
    for (; j < springs.points.size() && springs.set[j] == set; ++j) {
      const auto [p, q] = springs.points[j];
      const std::array<int64_t, 2> ends = {points.column[p], points.column[q]};
      if (ends != before) ++k;
      before = ends;
      place.push_back(each * number[k / each] + k % each);
      owned.push_back(rank_columns.owner[ends[0]] == rank);
    }
    const int64_t places = each * (connects ? rank_columns.columns : rank_columns.edges);
    const ColumnRows rows = rows_by_column(comm, places, place, owned);
    for (const int64_t row : rows.row) all.row.push_back(all.total + row);
    all.total += rows.total;
  }
  return all;
}

/// Numbers the piece's elements in the whole model. Collective.
void number_elements(MPI_Comm comm, const RankColumns& rank_columns, const PiecePoints& points,
                     Piece& piece) {
  const int rank = base::rank(comm);
  ColumnRows springs, edges = rows_of_edges(comm, rank, rank_columns, points, piece.model);
  if (!piece.solid)
    springs = rows_of_springs(comm, rank, rank_columns, points, piece.model.springs);
  piece.spring_row = std::move(springs.row);
  piece.edge_row = std::move(edges.row);
  piece.prism_row = rows_of_prisms(rank_columns);
  piece.counts.springs = springs.total;
  piece.counts.prisms = (rank_columns.layers - 1) * rank_columns.triangles;
  piece.counts.edges = edges.total;
}

/// Gives the elements of a piece without incisions what balances those of the whole model.
/// Edges at the border of the piece keep their weights. Collective.
void take_balance(MPI_Comm comm, const LocalModel& balanced, const RankColumns& rank_columns,
                  const PiecePoints& points, model::Model& model) {
  const model::ModelRows slabs = NaturalRows::of_model(comm, balanced);
  const NaturalRows natural(comm, balanced.part);
  if (!balanced.part.solid) {
    const ColumnRows rows =
        rows_of_springs(comm, base::rank(comm), rank_columns, points, model.springs);
    model.springs.rest_length = natural.at_rows(rows.row, rows.total, slabs.springs.rest_length);
    return;
  }
  std::vector<int64_t> known, edge_row;
  model.prisms.target_volume = natural.at_rows(rows_of_prisms(rank_columns), slabs.counts.prisms,
                                               slabs.prisms.target_volume);
  const ColumnRows rows = rows_of_edges(comm, base::rank(comm), rank_columns, points, model);
  for (size_t e = 0; e < rows.row.size(); ++e)
    if (rows.row[e] >= 0) known.push_back(static_cast<int64_t>(e)), edge_row.push_back(rows.row[e]);
  const std::vector<double> weight = natural.at_rows(edge_row, rows.total, slabs.edges.weight);
  for (size_t k = 0; k < known.size(); ++k) model.edges.weight[known[k]] = weight[k];
}

/// Parts the lips, or makes all other cuts of the piece. Collective.
void cut_piece(MPI_Comm comm, const RankColumns& rank_columns, bool lips, model::Model& model) {
  base::collective_try(comm, [&] { model::make_cuts(rank_columns.cuts, lips, model); });
}

/// Rows of contact in the whole model. Collective.
void number_pairs(MPI_Comm comm, const RankColumns& rank_columns, LocalModel& local_model) {
  std::vector<int64_t> column;
  for (const int64_t point : local_model.part.model.contact.pairs.point)
    column.push_back(list_column(rank_columns, local_model.part.point_row[point]));
  ColumnRows rows =
      rows_by_column(comm, list_columns(rank_columns), column, std::vector<char>(column.size(), 1));
  local_model.part.pair_row = std::move(rows.row);
  local_model.contact_pairs = rows.total;
}

/// The sides of cuts in rows of the whole model, on rank 0, from the rank that has them.
/// Collective.
model::CutFaces gather_cut_faces(MPI_Comm comm, const Part& part) {
  model::CutFaces faces = part.model.contact.cut_faces;
  for (int64_t& point : faces.point) point = part.point_row[point];
  const auto gather_to_root = [&](auto&... arrays) {
    ((arrays = base::gather(comm, std::move(arrays))), ...);
  };
  gather_to_root(faces.size, faces.begin, faces.point, faces.weight, faces.area);
  return faces;
}

/// The elements of all parts by their first points, of which each has one at most. On rank 0;
/// collective.
std::vector<model::TermElements> gather_elements(MPI_Comm comm, const Part& part) {
  std::vector<model::TermElements> all = part.model.elements;
  for (model::TermElements& elements : all) {
    for (int64_t& point : elements.points) point = part.point_row[point];
    elements.points = base::gather(comm, std::move(elements.points));
    elements.numbers = base::gather(comm, std::move(elements.numbers));
    const model::TermElements unsorted = std::move(elements);
    elements = {unsorted.term,       unsorted.points_each, unsorted.numbers_each, {}, {},
                unsorted.bone_number};
    std::map<int64_t, size_t> by_point;
    for (size_t e = 0; e < unsorted.size(); ++e) by_point[unsorted.points_of(e)[0]] = e;
    for (const auto& [point, e] : by_point)
      elements.add(unsorted.points_of(e), unsorted.numbers_of(e));
  }
  if (base::rank(comm) > 0) all.clear();
  return all;
}

}  // namespace

LocalModel build_local(MPI_Comm comm, const model::ColumnGeometry* geometry, scene::Scene scene,
                       const LocalModel* balanced) {
  static const PetscLogEvent event = base::log_event("RpPartition");
  const base::Logged logged(event);
  model::Model global_metadata;
  std::vector<surface::Surface> bones;
  const RankColumns rank_columns = distribute_columns(comm, geometry, global_metadata, bones);
  base::broadcast(comm, scene.moves, global_metadata.contact.spacing);
  Piece piece;
  model::Model& model = piece.model;
  model = build_piece(comm, scene, bones, rank_columns.piece);
  model.contact.spacing = global_metadata.contact.spacing;
  piece.solid = scene.tissue.material.has_value();
  const double effective_modulus = set_mean_moduli(comm, scene, rank_columns, model);
  remove_empty_terms(comm, model);
  const PiecePoints points = points_of(rank_columns);
  cut_piece(comm, rank_columns, true, model);
  if (balanced) take_balance(comm, *balanced, rank_columns, points, model);
  cut_piece(comm, rank_columns, false, model);
  piece.bones = bone_motions(model);
  number_points(rank_columns, points, piece);
  number_elements(comm, rank_columns, points, piece);
  LocalModel local_model = build_part(comm, piece);
  const Part& part = local_model.part;
  local_model.effective_modulus = effective_modulus;
  number_pairs(comm, rank_columns, local_model);
  global_metadata.elements = gather_elements(comm, part);
  global_metadata.contact.cut_faces = gather_cut_faces(comm, part);
  if (part.contact) global_metadata.contact.bodies = model.contact.bodies;
  global_metadata.contact.stiffness = model.contact.stiffness;
  if (base::rank(comm) == 0) global_metadata.spring_sets = std::move(model.spring_sets);
  local_model.global_metadata = std::move(global_metadata);
  return local_model;
}

}  // namespace repose::discrete
