#include "repose/solve/partition.h"

#include <petscmat.h>

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::solve {

namespace {

using base::check;

std::vector<std::array<int64_t, 2>> column_pairs(const model::Model& model,
                                                 const std::vector<int64_t>& column) {
  std::vector<std::array<int64_t, 2>> pairs;
  const auto link = [&](int64_t p, int64_t q) {
    if (column[p] == column[q]) return;
    pairs.push_back({column[p], column[q]});
    pairs.push_back({column[q], column[p]});
  };
  for (const auto& [p, q] : model.springs.points) link(p, q);
  for (const auto& corners : model.prisms.points)
    for (int c = 1; c < 6; ++c) link(corners[0], corners[c]);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/// This rank's slab of a vector that lives on rank 0, as PetscInt in PETSc's own memory.
PetscInt* scatter_slab(MPI_Comm comm, const std::vector<PetscInt>& all,
                       const std::vector<int>& counts) {
  std::vector<int> starts(counts.size(), 0);
  std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
  const int mine = counts[base::rank(comm)];
  PetscInt* slab = nullptr;
  check(PetscMalloc1(std::max(mine, 1), &slab));
  MPI_Scatterv(all.data(), counts.data(), starts.data(), MPIU_INT, slab, mine, MPIU_INT, 0, comm);
  return slab;
}

std::vector<int> slab_counts(MPI_Comm comm, int64_t n) {
  std::vector<int> counts(base::size(comm));
  for (size_t r = 0; r < counts.size(); ++r)
    counts[r] = static_cast<int>(base::slab(n, static_cast<int>(r), base::size(comm)).rows());
  return counts;
}

/// The column graph as a distributed adjacency matrix, rows in slabs.
base::MatHandle adjacency(MPI_Comm comm, const ColumnGraph& graph, int64_t columns,
                          const std::vector<int>& rows) {
  std::vector<int> entries(rows.size(), 0);
  std::vector<PetscInt> row_length, neighbour(graph.neighbour.begin(), graph.neighbour.end());
  for (int64_t c = 0; c < graph.columns(); ++c)
    row_length.push_back(static_cast<PetscInt>(graph.row_begin[c + 1] - graph.row_begin[c]));
  if (base::rank(comm) == 0)
    for (size_t r = 0; r < rows.size(); ++r) {
      const auto slab = base::slab(columns, static_cast<int>(r), base::size(comm));
      entries[r] = static_cast<int>(graph.row_begin[slab.end] - graph.row_begin[slab.begin]);
    }
  MPI_Bcast(entries.data(), static_cast<int>(entries.size()), MPI_INT, 0, comm);
  PetscInt* lengths = scatter_slab(comm, row_length, rows);
  PetscInt* columns_of_row = scatter_slab(comm, neighbour, entries);
  const int mine = rows[base::rank(comm)];
  PetscInt* begin = nullptr;
  check(PetscMalloc1(mine + 1, &begin));
  begin[0] = 0;
  std::partial_sum(lengths, lengths + mine, begin + 1);
  check(PetscFree(lengths));
  base::MatHandle matrix;
  check(MatCreateMPIAdj(comm, mine, static_cast<PetscInt>(columns), begin, columns_of_row, nullptr,
                        matrix.out()));
  return matrix;
}

std::vector<int> in_order(int64_t columns, int ranks) {
  std::vector<int> owner(columns);
  for (int r = 0; r < ranks; ++r) {
    const auto slab = base::slab(columns, r, ranks);
    std::fill(owner.begin() + slab.begin, owner.begin() + slab.end, r);
  }
  return owner;
}

std::vector<int> by_scotch(MPI_Comm comm, const ColumnGraph& graph, int64_t columns) {
  const std::vector<int> rows = slab_counts(comm, columns);
  const base::MatHandle matrix = adjacency(comm, graph, columns, rows);
  base::Handle<MatPartitioning, MatPartitioningDestroy> partitioning;
  check(MatPartitioningCreate(comm, partitioning.out()));
  check(MatPartitioningSetAdjacency(partitioning, matrix));
  check(MatPartitioningSetType(partitioning, MATPARTITIONINGPTSCOTCH));
  const std::vector<PetscInt> weights(graph.weight.begin(), graph.weight.end());
  check(MatPartitioningSetVertexWeights(partitioning, scatter_slab(comm, weights, rows)));
  base::check_options(MatPartitioningSetFromOptions(partitioning));
  base::IndexSetHandle assignment;
  check(MatPartitioningApply(partitioning, assignment.out()));
  const PetscInt* mine = nullptr;
  check(ISGetIndices(assignment, &mine));
  std::vector<PetscInt> all(base::rank(comm) == 0 ? columns : 0);
  std::vector<int> starts(rows.size(), 0);
  std::partial_sum(rows.begin(), rows.end() - 1, starts.begin() + 1);
  MPI_Gatherv(mine, rows[base::rank(comm)], MPIU_INT, all.data(), rows.data(), starts.data(),
              MPIU_INT, 0, comm);
  check(ISRestoreIndices(assignment, &mine));
  return {all.begin(), all.end()};
}

/// Adds the connected piece of `start`, breadth first, to `visited`; `round` marks what is met.
void walk(const ColumnGraph& graph, int64_t start, int round, std::vector<int>& met,
          std::vector<int64_t>& visited) {
  size_t next = visited.size();
  visited.push_back(start);
  met[start] = round;
  for (; next < visited.size(); ++next)
    for (int64_t k = graph.row_begin[visited[next]]; k < graph.row_begin[visited[next] + 1]; ++k) {
      const int64_t other = graph.neighbour[k];
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

ColumnGraph column_graph(const model::Model& model) {
  ColumnGraph graph;
  std::unordered_map<int64_t, int64_t> number;
  for (int64_t name : model.points.column)
    graph.column_of_point.push_back(
        number.emplace(name, static_cast<int64_t>(number.size())).first->second);
  graph.weight.assign(number.size(), 1);
  for (size_t p = 0; p < model.points.set.size(); ++p)
    if (model.points.set[p] == model::PointSet::soft_tissue)
      ++graph.weight[graph.column_of_point[p]];
  graph.row_begin.assign(number.size() + 1, 0);
  for (const auto& [from, to] : column_pairs(model, graph.column_of_point)) {
    ++graph.row_begin[from + 1];
    graph.neighbour.push_back(to);
  }
  std::partial_sum(graph.row_begin.begin(), graph.row_begin.end(), graph.row_begin.begin());
  return graph;
}

std::vector<int> partition(MPI_Comm comm, const ColumnGraph& graph) {
  int64_t columns = graph.columns();
  MPI_Bcast(&columns, 1, MPI_INT64_T, 0, comm);
  const int ranks = base::size(comm);
  constexpr int64_t worth_a_partition = 8;  // columns a rank
  if (ranks > 1 && columns >= worth_a_partition * ranks) return by_scotch(comm, graph, columns);
  if (base::rank(comm) != 0) return {};
  return in_order(columns, ranks);
}

}  // namespace repose::solve
