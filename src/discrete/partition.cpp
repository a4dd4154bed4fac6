#include "partition.h"

#include <petscmat.h>

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::discrete {

namespace {

using base::check;

/// Calls link(c, d) for every two columns that an element joins, both ways, as often as elements
/// join them.
template <class Link>
void for_each_link(const model::Model& model, const std::vector<int64_t>& column, Link&& link) {
  const auto join = [&](int64_t p, int64_t q) {
    if (column[p] == column[q]) return;
    link(column[p], column[q]);
    link(column[q], column[p]);
  };
  for (const auto& [p, q] : model.springs.points) join(p, q);
  for (const auto& [p, q] : model.edges.points) join(p, q);
  for (const auto& corners : model.prisms.points)
    for (int c = 1; c < 6; ++c) join(corners[0], corners[c]);
}

/// Fills in the graph's edges, each once, by columns: of a fine model there are many times more
/// links than edges.
void add_edges(const model::Model& model, ColumnGraph& graph) {
  std::vector<int64_t>&begin = graph.row_begin, &neighbor = graph.neighbor;
  for_each_link(model, graph.column_of_point, [&](int64_t c, int64_t) { ++begin[c + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int64_t> end(begin.begin(), begin.end() - 1);
  neighbor.resize(begin.back());
  for_each_link(model, graph.column_of_point,
                [&](int64_t c, int64_t d) { neighbor[end[c]++] = d; });
  auto kept = neighbor.begin();
  for (size_t c = 0; c < end.size(); ++c) {
    const auto first = neighbor.begin() + begin[c], last = neighbor.begin() + end[c];
    std::sort(first, last);
    begin[c] = kept - neighbor.begin();
    for (auto next = first; next != last; ++next)
      if (next == first || *next != kept[-1]) *kept++ = *next;
  }
  begin.back() = kept - neighbor.begin();
  neighbor.erase(kept, neighbor.end());
  neighbor.shrink_to_fit();
}

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

ColumnGraph column_graph(const model::Model& model) {
  ColumnGraph graph;
  std::unordered_map<int64_t, int64_t> number;
  graph.column_of_point.reserve(model.points.column.size());
  for (int64_t name : model.points.column)
    graph.column_of_point.push_back(
        number.emplace(name, static_cast<int64_t>(number.size())).first->second);
  graph.weight.assign(number.size(), 1);
  for (size_t p = 0; p < model.points.set.size(); ++p)
    if (model.points.set[p] == model::PointSet::soft_tissue)
      ++graph.weight[graph.column_of_point[p]];
  graph.row_begin.assign(number.size() + 1, 0);
  add_edges(model, graph);
  return graph;
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
