#include "repose/solve/tangent.h"

#include <algorithm>

#include "repose/base/agreement.h"
#include "repose/base/petsc_versions.h"

namespace repose::solve {

using base::check;
using mechanics::Curvature;

Tangent::Tangent(Objective& objective)
    : objective_(objective),
      part_(objective.positions().part()),
      diagonal_(objective.positions().make_vector()) {
  make_pattern();
  make_matrix();
  make_action();
  find_slots();
}

bool Tangent::owns(int32_t point) const {
  return part_.unknown[point] >= 0 && point < part_.owned_points;
}

void Tangent::make_pattern() {
  std::vector<std::vector<int32_t>> neighbours(part_.owned_unknowns);
  const auto link = [&](int32_t p, int32_t q) {
    if (!owns(p) || part_.unknown[q] < 0) return;
    neighbours[part_.unknown[p] - part_.first_unknown].push_back(
        static_cast<int32_t>(part_.unknown[q]));
  };
  for (int64_t i = 0; i < part_.owned_points; ++i)
    link(static_cast<int32_t>(i), static_cast<int32_t>(i));
  for (const auto& loop : objective_.loops().springs)
    for (const auto& [p, q] : loop.points) link(p, q), link(q, p);
  if (objective_.weights().volume != mechanics::VolumeTerm::none)
    for (const auto& corners : objective_.loops().prisms.points)
      for (int32_t p : corners)
        for (int32_t q : corners) link(p, q);
  const int64_t first = part_.first_unknown, last = first + part_.owned_unknowns;
  for (BlockRows& rows : rows_) rows.begin.push_back(0);
  for (auto& row : neighbours) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    for (int32_t column : row)
      rows_[column >= first && column < last ? 0 : 1].column.push_back(column);
    for (BlockRows& rows : rows_) rows.begin.push_back(static_cast<int32_t>(rows.column.size()));
  }
}

void Tangent::make_matrix() {
  const auto owned = static_cast<PetscInt>(part_.owned_unknowns);
  std::vector<PetscInt> count[2];
  for (int side = 0; side < 2; ++side)
    for (PetscInt k = 0; k < owned; ++k)
      count[side].push_back(rows_[side].begin[k + 1] - rows_[side].begin[k]);
  const auto total = static_cast<PetscInt>(part_.total_unknowns);
  check(MatCreate(objective_.positions().comm(), convex_.out()));
  check(MatSetSizes(convex_, 3 * owned, 3 * owned, 3 * total, 3 * total));
  check(MatSetBlockSize(convex_, 3));
  check(MatSetType(convex_, MATAIJ));
  check(MatXAIJSetPreallocation(convex_, 3, count[0].data(), count[1].data(), nullptr, nullptr));
  check(MatSetOption(convex_, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  for (PetscInt k = 0; k < owned; ++k) {
    const auto row = static_cast<PetscInt>(part_.first_unknown + k);
    for (const BlockRows& rows : rows_) {
      const PetscInt n = rows.begin[k + 1] - rows.begin[k];
      const std::vector<PetscScalar> zeros(9 * n, 0.0);
      const std::vector<PetscInt> columns(rows.column.begin() + rows.begin[k],
                                          rows.column.begin() + rows.begin[k + 1]);
      check(MatSetValuesBlocked(convex_, 1, &row, n, columns.data(), zeros.data(), INSERT_VALUES));
    }
  }
  check(MatAssemblyBegin(convex_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(convex_, MAT_FINAL_ASSEMBLY));
  check(MatSetOption(convex_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(convex_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  check(MatSetOption(convex_, MAT_SPD, PETSC_TRUE));
}

void Tangent::make_action() {
  const auto owned = static_cast<PetscInt>(3 * part_.owned_unknowns);
  const auto total = static_cast<PetscInt>(3 * part_.total_unknowns);
  direction_.assign(part_.point_row.size(), Vec3::Zero());
  work_ = direction_;
  check(MatCreateShell(objective_.positions().comm(), owned, owned, total, total, this,
                       action_.out()));
  check(MatSetBlockSize(action_, 3));
  check(MatShellSetOperation(action_, MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
  check(MatSetOption(action_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(action_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

PetscErrorCode Tangent::multiply(Mat matrix, Vec direction, Vec product) {
  Tangent* self = nullptr;
  if (const PetscErrorCode code = MatShellGetContext(matrix, &self)) return code;
  try {
    const Objective& objective = self->objective_;
    objective.positions().spread(direction, self->direction_);
    std::fill(self->work_.begin(), self->work_.end(), Vec3::Zero());
    mechanics::add_hessian_action(objective.loops(), self->at_, objective.weights(),
                                  self->direction_, self->work_);
    objective.positions().keep_owned(self->work_, product);
  } catch (const std::exception&) {
    return PETSC_ERR_LIB;
  }
  return PETSC_SUCCESS;
}

Tangent::Slot Tangent::find(int32_t row_point, int32_t column_point) const {
  if (!owns(row_point) || part_.unknown[column_point] < 0) return -1;
  const int64_t k = part_.unknown[row_point] - part_.first_unknown;
  const auto column = static_cast<int32_t>(part_.unknown[column_point]);
  const int64_t offset = column - part_.first_unknown;
  const int side = offset >= 0 && offset < part_.owned_unknowns ? 0 : 1;
  const BlockRows& rows = rows_[side];
  const auto first = rows.column.begin() + rows.begin[k];
  const auto place = std::lower_bound(first, rows.column.begin() + rows.begin[k + 1], column);
  const int32_t before = side == 0 ? 0 : 9 * rows_[0].begin.back();
  return before + 9 * rows.begin[k] + 3 * static_cast<int32_t>(place - first);
}

void Tangent::find_slots() {
  for (const auto& loop : objective_.loops().springs) {
    auto& slots = spring_slots_.emplace_back();
    for (const auto& [p, q] : loop.points)
      slots.push_back({find(p, p), find(p, q), find(q, p), find(q, q)});
  }
  if (objective_.weights().volume == mechanics::VolumeTerm::none) return;
  for (const auto& corners : objective_.loops().prisms.points) {
    auto& slots = prism_slots_.emplace_back();
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) slots[6 * i + j] = find(corners[i], corners[j]);
  }
}

void Tangent::add(double* const values[2], Slot slot, int32_t row_point, const Mat3& block) const {
  if (slot < 0) return;
  const int32_t beyond = 9 * rows_[0].begin.back();
  const int side = slot < beyond ? 0 : 1;
  const int64_t k = part_.unknown[row_point] - part_.first_unknown;
  const int32_t stride = 3 * (rows_[side].begin[k + 1] - rows_[side].begin[k]);
  double* entry = values[side] + slot - (side == 0 ? 0 : beyond);
  for (int r = 0; r < 3; ++r, entry += stride)
    for (int c = 0; c < 3; ++c) entry[c] += block(r, c);
}

void Tangent::add_spring(double* const values[2], size_t loop, int64_t spring,
                         const Mat3& block) const {
  const auto [p, q] = objective_.loops().springs[loop].points[spring];
  const auto& slots = spring_slots_[loop][spring];
  add(values, slots[0], p, block);
  add(values, slots[1], p, -block);
  add(values, slots[2], q, -block);
  add(values, slots[3], q, block);
}

template <class Work>
void Tangent::refill(Mat matrix, Work&& add_blocks) {
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

void Tangent::fill(Mat matrix, Curvature curvature) {
  refill(matrix, [&](double* const values[2]) {
    for (size_t l = 0; l < spring_slots_.size(); ++l)
      mechanics::for_each_spring_block(
          objective_.loops().springs[l], at_, objective_.weights().elastic, curvature,
          [&](int64_t e, const Mat3& block) { add_spring(values, l, e, block); });
    const mechanics::PrismLoop& prisms = objective_.loops().prisms;
    mechanics::for_each_prism_block(prisms, at_, objective_.weights(), curvature,
                                    [&](int64_t e, const mechanics::PrismBlocks& blocks) {
                                      for (int i = 0; i < 6; ++i)
                                        for (int j = 0; j < 6; ++j)
                                          add(values, prism_slots_[e][6 * i + j],
                                              prisms.points[e][i], blocks[i][j]);
                                    });
  });
}

base::MatHandle Tangent::make_third() const {
  base::MatHandle matrix;
  check(MatDuplicate(convex_, MAT_DO_NOT_COPY_VALUES, matrix.out()));
  check(MatSetOption(matrix, MAT_SPD, PETSC_FALSE));
  check(MatSetOption(matrix, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  return matrix;
}

void Tangent::third(std::span<const Vec3> direction, Mat matrix) {
  refill(matrix, [&](double* const values[2]) {
    const auto position = objective_.positions().local();
    for (size_t l = 0; l < spring_slots_.size(); ++l)
      mechanics::for_each_spring_third(
          objective_.loops().springs[l], position, objective_.weights().elastic, direction,
          [&](int64_t e, const Mat3& block) { add_spring(values, l, e, block); });
  });
}

void Tangent::lift_diagonal() {
  constexpr double lift = 1e-9;  // keeps factors positive where the convex Hessian is singular
  check(MatGetDiagonal(convex_, diagonal_));
  PetscScalar* values = nullptr;
  PetscInt size = 0;
  check(VecGetLocalSize(diagonal_, &size));
  check(VecGetArray(diagonal_, &values));
  for (PetscInt i = 0; i < size; ++i) values[i] = values[i] > 0 ? values[i] * (1 + lift) : 1.0;
  check(VecRestoreArray(diagonal_, &values));
  check(MatDiagonalSet(convex_, diagonal_, INSERT_VALUES));
}

void Tangent::assemble(Vec displacement) {
  Positions& positions = objective_.positions();
  positions.update(displacement);
  // Takes back the multiples of 1 that TAO's line searches add to a Hessian.
  check(MatAssemblyBegin(action_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(action_, MAT_FINAL_ASSEMBLY));
  const auto now = positions.local();
  int same = at_.size() == now.size() && std::equal(now.begin(), now.end(), at_.begin());
  MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, positions.comm());
  if (same) return;
  at_.assign(now.begin(), now.end());
  ++assemblies_;
}

void Tangent::renew() {
  fill(convex_, Curvature::convex);
  lift_diagonal();
}

Mat Tangent::exact() {
  if (!exact_) exact_ = make_third();
  if (filled_at_ == assemblies_) return exact_;
  fill(exact_, Curvature::exact);
  filled_at_ = assemblies_;
  return exact_;
}

}  // namespace repose::solve
