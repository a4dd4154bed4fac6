#include "partition.h"

#include <petscmat.h>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::discrete {

namespace {

using base::check;

/// A copy in PETSc's own memory, which PETSc frees.
PetscInt* petsc_copy(const std::vector<int64_t>& values) {
  PetscInt* copy = nullptr;
  check(PetscMalloc1(std::max<size_t>(values.size(), 1), &copy));
  std::copy(values.begin(), values.end(), copy);
  return copy;
}

std::vector<int> in_order(int64_t columns, int ranks) {
  std::vector<int> owner(columns);
  for (int r = 0; r < ranks; ++r) {
    const auto slab = base::slab(columns, r, ranks);
    std::fill(owner.begin() + slab.begin, owner.begin() + slab.end, r);
  }
  return owner;
}

/// Rank 0 alone: it has the graph, and PT-Scotch 7.0 on several ranks can fold a graph of few
/// columns a rank for ever (dgraphFoldComm).
std::vector<int> by_scotch(const ColumnGraph& graph, int ranks) {
  const auto columns = static_cast<PetscInt>(graph.columns());
  base::MatHandle matrix;
  check(MatCreateMPIAdj(PETSC_COMM_SELF, columns, columns, petsc_copy(graph.row_begin),
                        petsc_copy(graph.neighbor), nullptr, matrix.out()));
  base::Handle<MatPartitioning, MatPartitioningDestroy> partitioning;
  check(MatPartitioningCreate(PETSC_COMM_SELF, partitioning.out()));
  check(MatPartitioningSetAdjacency(partitioning, matrix));
  check(MatPartitioningSetType(partitioning, MATPARTITIONINGPTSCOTCH));
  check(MatPartitioningSetNParts(partitioning, ranks));
  check(MatPartitioningSetVertexWeights(partitioning, petsc_copy(graph.weight)));
  base::check_options(MatPartitioningSetFromOptions(partitioning));
  base::IndexSetHandle assignment;
  check(MatPartitioningApply(partitioning, assignment.out()));
  const PetscInt* owner = nullptr;
  check(ISGetIndices(assignment, &owner));
  std::vector<int> all(owner, owner + columns);
  check(ISRestoreIndices(assignment, &owner));
  return all;
}

/// Adds the connected piece of `start`, breadth first, to `visited`; `round` marks what is met.
void walk(const ColumnGraph& graph, int64_t start, int round, std::vector<int>& met,
          std::vector<int64_t>& visited) {
  size_t next = visited.size();
  visited.push_back(start);
  met[start] = round;
  for (; next < visited.size(); ++next)
    for (int64_t k = graph.row_begin[visited[next]]; k < graph.row_begin[visited[next] + 1]; ++k) {
      const int64_t other = graph.neighbor[k];
      if (met[other] == round) continue;
      met[other] = round;
      visited.push_back(other);
    }
}

}  // namespace

std::vector<int64_t> memory_order(const ColumnGraph& graph) {
  std::vector<int> met(graph.columns(), 0);
  std::vector<int64_t> visited, place(graph.columns());
  for (int64_t c = 0; c < graph.columns(); ++c) {
    if (met[c]) continue;
    const size_t before = visited.size();
    walk(graph, c, 1, met, visited);
    const int64_t end = visited.back();
    visited.resize(before);
    walk(graph, end, 2, met, visited);
  }
  for (size_t k = 0; k < visited.size(); ++k) place[visited[k]] = static_cast<int64_t>(k);
  return place;
}

std::vector<int> partition(MPI_Comm comm, const ColumnGraph& graph) {
  const int ranks = base::size(comm);
  constexpr int64_t worth_a_partition = 8;  // columns a rank
  std::vector<int> owner;
  base::on_root(comm, [&] {
    const bool worth = ranks > 1 && graph.columns() >= worth_a_partition * ranks;
    owner = worth ? by_scotch(graph, ranks) : in_order(graph.columns(), ranks);
  });
  return owner;
}

}  // namespace repose::discrete
