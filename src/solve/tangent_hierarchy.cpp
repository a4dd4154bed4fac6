#include "repose/solve/tangent_hierarchy.h"

#include <cmath>
#include <numeric>

#include "repose/base/petsc.h"

namespace repose::solve {

using base::check;

namespace {

constexpr PetscInt coarse_enough = 1500;  // scalar unknowns that are solved for by factors
constexpr int64_t none = -1;

MPI_Comm comm_of(Mat matrix) { return PetscObjectComm(reinterpret_cast<PetscObject>(matrix)); }

/// The neighbours of each block row of this rank, among them and of the same layer.
struct Graph {
  std::vector<int32_t> begin{0}, neighbour;
  size_t size() const { return begin.size() - 1; }
  template <class Visit>
  void for_each_neighbour(size_t row, Visit&& visit) const {
    for (int32_t k = begin[row]; k < begin[row + 1]; ++k) visit(neighbour[k]);
  }
};

Graph same_layer_graph(Mat matrix, const std::vector<int32_t>& layer) {
  Mat mine = nullptr;
  check(MatGetDiagonalBlock(matrix, &mine));
  PetscInt rows = 0;
  const PetscInt *begin = nullptr, *column = nullptr;
  PetscBool done = PETSC_FALSE;
  check(MatGetRowIJ(mine, 0, PETSC_FALSE, PETSC_FALSE, &rows, &begin, &column, &done));
  Graph graph;
  for (PetscInt row = 0; row < rows; row += 3) {
    for (PetscInt k = begin[row]; k < begin[row + 1]; ++k)
      if (column[k] % 3 == 0 && column[k] != row && layer[column[k] / 3] == layer[row / 3])
        graph.neighbour.push_back(column[k] / 3);
    graph.begin.push_back(static_cast<int32_t>(graph.neighbour.size()));
  }
  check(MatRestoreRowIJ(mine, 0, PETSC_FALSE, PETSC_FALSE, &rows, &begin, &column, &done));
  return graph;
}

/// The rows of this rank in groups of neighbours.
struct Aggregates {
  std::vector<int64_t> of;  // [rows] number of the aggregate
  std::vector<int32_t> layer;
};

/// Rows whose neighbours are all free start an aggregate with them; what is left joins a
/// neighbour's or stays alone.
Aggregates aggregate(const Graph& graph, const std::vector<int32_t>& layer) {
  Aggregates found{std::vector<int64_t>(graph.size(), none), {}};
  const auto start = [&](size_t row) {
    found.of[row] = static_cast<int64_t>(found.layer.size());
    found.layer.push_back(layer[row]);
  };
  for (size_t row = 0; row < graph.size(); ++row) {
    bool free = found.of[row] == none;
    graph.for_each_neighbour(row, [&](int32_t other) { free &= found.of[other] == none; });
    if (!free) continue;
    start(row);
    graph.for_each_neighbour(row, [&](int32_t other) { found.of[other] = found.of[row]; });
  }
  const std::vector<int64_t> roots = found.of;
  for (size_t row = 0; row < graph.size(); ++row)
    if (roots[row] == none)
      graph.for_each_neighbour(row, [&](int32_t other) {
        if (found.of[row] == none) found.of[row] = roots[other];
      });
  for (size_t row = 0; row < graph.size(); ++row)
    if (found.of[row] == none) start(row);
  return found;
}

/// Carries each aggregate's translation to its rows.
base::MatHandle tentative(Mat matrix, const Aggregates& aggregates) {
  const auto rows = static_cast<PetscInt>(3 * aggregates.of.size());
  const auto columns = static_cast<PetscInt>(3 * aggregates.layer.size());
  base::MatHandle carry;
  check(MatCreate(comm_of(matrix), carry.out()));
  check(MatSetSizes(carry, rows, columns, PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetType(carry, MATAIJ));
  check(MatSetBlockSizes(carry, 3, 3));
  check(MatSeqAIJSetPreallocation(carry, 1, nullptr));
  check(MatMPIAIJSetPreallocation(carry, 1, nullptr, 0, nullptr));
  PetscInt first_row = 0, first_column = 0;
  check(MatGetOwnershipRange(carry, &first_row, nullptr));
  check(MatGetOwnershipRangeColumn(carry, &first_column, nullptr));
  for (PetscInt row = 0; row < rows; ++row)
    check(MatSetValue(carry, first_row + row,
                      first_column + static_cast<PetscInt>(3 * aggregates.of[row / 3]) + row % 3, 1,
                      INSERT_VALUES));
  check(MatAssemblyBegin(carry, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(carry, MAT_FINAL_ASSEMBLY));
  return carry;
}

/// The largest eigenvalue of D⁻¹ A, nearly, by the power method.
double largest_eigenvalue(Mat matrix, Vec inverse_diagonal) {
  constexpr int steps = 10;
  base::VecHandle x, y;
  check(MatCreateVecs(matrix, x.out(), y.out()));
  PetscInt begin = 0, end = 0;
  check(VecGetOwnershipRange(x, &begin, &end));
  for (PetscInt i = begin; i < end; ++i)
    check(VecSetValue(x, i, std::sin(static_cast<double>(i)), INSERT_VALUES));
  check(VecAssemblyBegin(x));
  check(VecAssemblyEnd(x));
  PetscReal norm = 0;
  for (int k = 0; k < steps; ++k) {
    check(VecNormalize(x, nullptr));
    check(MatMult(matrix, x, y));
    check(VecPointwiseMult(x, inverse_diagonal, y));
    check(VecNorm(x, NORM_2, &norm));
  }
  return norm;
}

/// (1 − ω D⁻¹ A) of the tentative: what a step of damped Jacobi makes of it.
base::MatHandle smoothed(Mat matrix, Mat carry) {
  constexpr double damping = 4.0 / 3.0;
  base::VecHandle inverse;
  check(MatCreateVecs(matrix, inverse.out(), nullptr));
  check(MatGetDiagonal(matrix, inverse));
  check(VecReciprocal(inverse));
  const double omega = damping / largest_eigenvalue(matrix, inverse);
  base::MatHandle result;
  check(MatMatMult(matrix, carry, MAT_INITIAL_MATRIX, PETSC_DEFAULT, result.out()));
  check(VecScale(inverse, -omega));
  check(MatDiagonalScale(result, inverse, nullptr));
  check(MatAXPY(result, 1, carry, SUBSET_NONZERO_PATTERN));
  return result;
}

PetscInt rows_of(Mat matrix) {
  PetscInt rows = 0;
  check(MatGetSize(matrix, &rows, nullptr));
  return rows;
}

/// Two sweeps of Gauss–Seidel forth and back on each level.
void choose_smoothers(PC pc, PetscInt levels) {
  constexpr PetscInt sweeps = 2;
  for (PetscInt level = 1; level < levels; ++level) {
    KSP smoother = nullptr;
    PC sweep = nullptr;
    check(PCMGGetSmoother(pc, level, &smoother));
    check(KSPSetType(smoother, KSPRICHARDSON));
    check(KSPSetTolerances(smoother, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, sweeps));
    check(KSPGetPC(smoother, &sweep));
    check(PCSetType(sweep, PCSOR));
  }
}

}  // namespace

void make_hierarchy(PC pc, Mat fine, std::vector<int32_t> layer) {
  constexpr double least_coarsening = 0.7;
  std::vector<base::MatHandle> carries, coarse;
  Mat matrix = fine;
  while (rows_of(matrix) > coarse_enough) {
    Aggregates aggregates = aggregate(same_layer_graph(matrix, layer), layer);
    base::MatHandle carry = smoothed(matrix, tentative(matrix, aggregates));
    base::MatHandle product;
    check(MatPtAP(matrix, carry, MAT_INITIAL_MATRIX, PETSC_DEFAULT, product.out()));
    if (rows_of(product) > least_coarsening * rows_of(matrix)) break;
    matrix = product;
    layer = std::move(aggregates.layer);
    carries.push_back(std::move(carry));
    coarse.push_back(std::move(product));
  }
  const auto levels = static_cast<PetscInt>(carries.size() + 1);
  check(PCMGSetLevels(pc, levels, nullptr));
  check(PCSetUseAmat(pc, PETSC_FALSE));
  check(PCMGSetGalerkin(pc, PC_MG_GALERKIN_BOTH));
  for (PetscInt level = 1; level < levels; ++level)
    check(PCMGSetInterpolation(pc, level, carries[levels - 1 - level]));
  choose_smoothers(pc, levels);
}

}  // namespace repose::solve
