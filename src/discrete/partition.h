#pragma once
#include <mpi.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace repose::discrete {

/// Graph of columns that share a spring, a prism or an edge, in compressed rows.
struct ColumnGraph {
  std::vector<int64_t> row_begin;  ///< [columns + 1]
  std::vector<int64_t> neighbor;   ///< sorted in each row, no column its own neighbor
  std::vector<int64_t> weight;     ///< [columns] 1 + soft-tissue points
  int64_t columns() const { return static_cast<int64_t>(row_begin.size()) - 1; }
};

/// Returns the graph, without weights, of links between columns, each of which
/// `for_each_link(link)` gives to link(c, d) as often as it likes: a fine model has many times more
/// links than edges.
template <class ForEachLink>
ColumnGraph column_graph(int64_t columns, const ForEachLink& for_each_link) {
  ColumnGraph graph;
  std::vector<int64_t>&begin = graph.row_begin, &neighbor = graph.neighbor;
  begin.assign(columns + 1, 0);
  for_each_link([&](int64_t c, int64_t) { ++begin[c + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int64_t> end(begin.begin(), begin.end() - 1);
  neighbor.resize(begin.back());
  for_each_link([&](int64_t c, int64_t d) { neighbor[end[c]++] = d; });
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
  return graph;
}

/// [columns] Place of each column in an order that keeps neighbors near one another in memory,
/// whatever the skin's vertices are numbered like: breadth first from a column at the end of each
/// connected piece (Cuthill & McKee 1969, without sorting by degree). Linear in the graph.
std::vector<int64_t> memory_order(const ColumnGraph& graph);

/// Owner rank of each column, on rank 0 (empty elsewhere), by rank 0 alone, where `graph` is.
/// Few columns a rank (< 8) are dealt out in order instead of by PT-Scotch. Collective.
std::vector<int> partition(MPI_Comm comm, const ColumnGraph& graph);

}  // namespace repose::discrete
