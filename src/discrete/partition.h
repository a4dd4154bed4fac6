#pragma once
#include <mpi.h>

#include <cstdint>
#include <vector>

#include "repose/model/model.h"

namespace repose::discrete {

/// Which columns share a spring or a prism, in compressed rows.
struct ColumnGraph {
  std::vector<int64_t> column_of_point;  ///< [N] 0-based, consecutive, in order of first appearance
  std::vector<int64_t> row_begin;        ///< [columns + 1]
  std::vector<int64_t> neighbor;         ///< sorted in each row, no column its own neighbor
  std::vector<int64_t> weight;           ///< [columns] 1 + soft-tissue points
  int64_t columns() const { return static_cast<int64_t>(weight.size()); }
};
ColumnGraph column_graph(const model::Model& model);

/// [columns] Place of each column in an order that keeps neighbors near one another in memory,
/// whatever the skin's vertices are numbered like: breadth first from a column at the end of each
/// connected piece (Cuthill & McKee 1969, without sorting by degree). Linear in the graph.
std::vector<int64_t> memory_order(const ColumnGraph& graph);

/// Owner rank of each column, on rank 0 (empty elsewhere), by rank 0 alone, where `graph` is.
/// Few columns a rank (< 8) are dealt out in order instead of by PT-Scotch. Collective.
std::vector<int> partition(MPI_Comm comm, const ColumnGraph& graph);

}  // namespace repose::discrete
