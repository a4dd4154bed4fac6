#include "repose/discrete/tangent_entries.h"

#include <algorithm>
#include <set>

#include "countable.h"
#include "repose/base/agreement.h"

namespace repose::discrete {

using base::check;
using mechanics::Curvature;

TangentEntries::TangentEntries(const Objective& objective)
    : objective_(objective), part_(objective.positions().part()) {
  make_pattern();
  base::collective_try(objective.positions().comm(), [this] {
    require_addressable(static_cast<int64_t>(rows_[0].column.size() + rows_[1].column.size()));
  });
  make_pattern_matrix();
  find_slots();
}

bool TangentEntries::owns(int32_t point) const {
  return part_.unknown[point] >= 0 && point < part_.owned_points;
}

namespace {

/// Calls link(p, q) for points of the sides of one cut, whichever may come to face.
template <class Link>
void for_each_facing_pair(const model::CutFaces& cut_faces, Link&& link) {
  size_t control = 0;
  for (const auto& [columns, rows] : cut_faces.size) {
    const auto first = cut_faces.begin[control];
    control += 2 * static_cast<size_t>(columns * rows);
    const std::set<int64_t> points(cut_faces.point.begin() + first,
                                   cut_faces.point.begin() + cut_faces.begin[control]);
    for (const int64_t p : points)
      for (const int64_t q : points) link(static_cast<int32_t>(p), static_cast<int32_t>(q));
  }
}

}  // namespace

void TangentEntries::make_pattern() {
  std::vector<std::vector<int32_t>> neighbors(part_.unknowns.owned);
  const auto link = [&](int32_t p, int32_t q) {
    if (!owns(p) || part_.unknown[q] < 0) return;
    neighbors[part_.unknown[p] - part_.unknowns.first].push_back(
        static_cast<int32_t>(part_.unknown[q]));
  };
  for (int64_t i = 0; i < part_.owned_points; ++i)
    link(static_cast<int32_t>(i), static_cast<int32_t>(i));
  for (const auto& loop : objective_.loops().springs)
    for (const auto& [p, q] : loop.points) link(p, q), link(q, p);
  for (const auto& [p, q] : objective_.loops().edges.points) link(p, q), link(q, p);
  if (objective_.weights().volume != mechanics::VolumeTerm::none)
    for (const auto& corners : objective_.loops().prisms.points)
      for (int32_t p : corners)
        for (int32_t q : corners) link(p, q);
  for (const mechanics::TermLoop& loop : objective_.loops().terms) loop.for_each_link(link);
  for_each_facing_pair(part_.model.contact.cut_faces, link);
  const int64_t first = part_.unknowns.first, last = first + part_.unknowns.owned;
  for (BlockRows& rows : rows_) rows.begin.push_back(0);
  for (auto& row : neighbors) {
    base::sort_unique(row);
    for (int32_t column : row)
      rows_[column >= first && column < last ? 0 : 1].column.push_back(column);
    for (BlockRows& rows : rows_) rows.begin.push_back(static_cast<PetscInt>(rows.column.size()));
  }
}

void TangentEntries::make_pattern_matrix() {
  const auto owned = static_cast<PetscInt>(part_.unknowns.owned);
  std::vector<PetscInt> count[2];
  for (int side = 0; side < 2; ++side)
    for (PetscInt k = 0; k < owned; ++k)
      count[side].push_back(rows_[side].begin[k + 1] - rows_[side].begin[k]);
  const auto total = static_cast<PetscInt>(part_.unknowns.total);
  check(MatCreate(objective_.positions().comm(), pattern_.out()));
  check(MatSetSizes(pattern_, 3 * owned, 3 * owned, 3 * total, 3 * total));
  check(MatSetBlockSize(pattern_, 3));
  check(MatSetType(pattern_, MATAIJ));
  check(MatXAIJSetPreallocation(pattern_, 3, count[0].data(), count[1].data(), nullptr, nullptr));
  check(MatSetOption(pattern_, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  for (PetscInt k = 0; k < owned; ++k) {
    const auto row = static_cast<PetscInt>(part_.unknowns.first + k);
    for (const BlockRows& rows : rows_) {
      const PetscInt n = rows.begin[k + 1] - rows.begin[k];
      const std::vector<PetscScalar> zeros(size_t{9} * n, 0.0);
      const std::vector<PetscInt> columns(rows.column.begin() + rows.begin[k],
                                          rows.column.begin() + rows.begin[k + 1]);
      check(MatSetValuesBlocked(pattern_, 1, &row, n, columns.data(), zeros.data(), INSERT_VALUES));
    }
  }
  check(MatAssemblyBegin(pattern_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(pattern_, MAT_FINAL_ASSEMBLY));
  check(MatSetOption(pattern_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(pattern_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

base::MatHandle TangentEntries::make() const {
  base::MatHandle matrix;
  check(MatDuplicate(pattern_, MAT_DO_NOT_COPY_VALUES, matrix.out()));
  check(MatSetOption(matrix, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  return matrix;
}

TangentEntries::Slot TangentEntries::find(int32_t row_point, int32_t column_point) const {
  if (!owns(row_point) || part_.unknown[column_point] < 0) return -1;
  const int64_t k = part_.unknown[row_point] - part_.unknowns.first;
  const auto column = static_cast<int32_t>(part_.unknown[column_point]);
  const int64_t offset = column - part_.unknowns.first;
  const int side = offset >= 0 && offset < part_.unknowns.owned ? 0 : 1;
  const BlockRows& rows = rows_[side];
  const auto first = rows.column.begin() + rows.begin[k];
  const auto last = rows.column.begin() + rows.begin[k + 1];
  const auto place = std::lower_bound(first, last, column);
  if (place == last || *place != column)
    throw base::InternalError("a block of the Hessian is outside its pattern");
  const PetscInt before = side == 0 ? 0 : 9 * rows_[0].begin.back();
  return before + 9 * rows.begin[k] + 3 * static_cast<PetscInt>(place - first);
}

std::vector<TangentEntries::PairSlots> TangentEntries::find_pairs(
    const std::vector<std::array<int32_t, 2>>& points) const {
  std::vector<PairSlots> slots;
  slots.reserve(points.size());
  for (const auto& [p, q] : points)
    slots.push_back({find(p, p), find(p, q), find(q, p), find(q, q)});
  return slots;
}

void TangentEntries::find_slots() {
  for (const auto& loop : objective_.loops().springs)
    spring_slots_.push_back(find_pairs(loop.points));
  edge_slots_ = find_pairs(objective_.loops().edges.points);
  if (objective_.weights().volume == mechanics::VolumeTerm::none) return;
  for (const auto& corners : objective_.loops().prisms.points) {
    auto& slots = prism_slots_.emplace_back();
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) slots[6 * i + j] = find(corners[i], corners[j]);
  }
}

void TangentEntries::add(double* const values[2], Slot slot, int32_t row_point,
                         const Mat3& block) const {
  if (slot < 0) return;
  const PetscInt beyond = 9 * rows_[0].begin.back();
  const int side = slot < beyond ? 0 : 1;
  const int64_t k = part_.unknown[row_point] - part_.unknowns.first;
  const PetscInt stride = 3 * (rows_[side].begin[k + 1] - rows_[side].begin[k]);
  double* entry = values[side] + slot - (side == 0 ? 0 : beyond);
  for (int r = 0; r < 3; ++r, entry += stride)
    for (int c = 0; c < 3; ++c) entry[c] += block(r, c);
}

void TangentEntries::add_pair(double* const values[2], const std::array<int32_t, 2>& points,
                              const PairSlots& slots, const Mat3& block) const {
  const auto [p, q] = points;
  add(values, slots[0], p, block);
  add(values, slots[1], p, -block);
  add(values, slots[2], q, -block);
  add(values, slots[3], q, block);
}

template <class Work>
void TangentEntries::refill(Mat matrix, Work&& add_blocks) const {
  Mat sides[2] = {matrix, nullptr};
  if (base::size(objective_.positions().comm()) > 1)
    check(MatMPIAIJGetSeqAIJ(matrix, &sides[0], &sides[1], nullptr));
  check(MatZeroEntries(matrix));
  double* values[2] = {nullptr, nullptr};
  for (int side = 0; side < 2; ++side)
    if (sides[side]) check(MatSeqAIJGetArray(sides[side], &values[side]));
  add_blocks(values);
  for (int side = 0; side < 2; ++side)
    if (sides[side]) check(MatSeqAIJRestoreArray(sides[side], &values[side]));
  check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
}

void TangentEntries::fill(Mat matrix, std::span<const Vec3> at,
                          std::span<const Objective::Block> blocks, Curvature curvature) const {
  const double scale = objective_.weights().elastic;
  const auto& springs = objective_.loops().springs;
  refill(matrix, [&](double* const values[2]) {
    for (size_t l = 0; l < spring_slots_.size(); ++l)
      mechanics::for_each_spring_block(
          springs[l], at, scale, curvature, [&](int64_t e, const Mat3& block) {
            add_pair(values, springs[l].points[e], spring_slots_[l][e], block);
          });
    const mechanics::EdgeLoop& edges = objective_.loops().edges;
    for (size_t e = 0; e < edge_slots_.size(); ++e)
      add_pair(values, edges.points[e], edge_slots_[e], scale * edges.weight[e] * Mat3::Identity());
    const mechanics::PrismLoop& prisms = objective_.loops().prisms;
    std::vector<double> max_slope;
    if (curvature == Curvature::semidefinite)
      max_slope = mechanics::semidefinite_slopes(prisms, part_.model.points.position, at);
    mechanics::for_each_prism_block(objective_.loops(), at, objective_.weights(), max_slope,
                                    [&](int64_t e, const mechanics::PrismBlocks& blocks) {
                                      for (int i = 0; i < 6; ++i)
                                        for (int j = 0; j < 6; ++j)
                                          add(values, prism_slots_[e][6 * i + j],
                                              prisms.points[e][i], blocks[i][j]);
                                    });
    for (const auto& [p, q, block] : blocks) {
      add(values, find(p, q), p, block);
      if (p != q) add(values, find(q, p), q, block.transpose());
    }
  });
}

void TangentEntries::fill_third(Mat matrix, std::span<const Vec3> position,
                                std::span<const Vec3> direction) const {
  const auto& springs = objective_.loops().springs;
  refill(matrix, [&](double* const values[2]) {
    for (size_t l = 0; l < spring_slots_.size(); ++l)
      mechanics::for_each_spring_third(springs[l], position, objective_.weights().elastic,
                                       direction, [&](int64_t e, const Mat3& block) {
                                         add_pair(values, springs[l].points[e], spring_slots_[l][e],
                                                  block);
                                       });
  });
}

}  // namespace repose::discrete
