#pragma once
#include <array>
#include <cstdint>
#include <vector>

/// The least cut between two sets of the nodes of a grid.
namespace repose::tools::bone_separation {

/// A graph whose nodes have up to six neighbors: across 2a and 2a + 1 along axis a. Every edge
/// goes both ways and has a capacity of its own each way.
struct GridGraph {
  std::vector<std::array<int32_t, 6>> neighbor;  ///< −1: none; that of d sees this one across d ^ 1
  std::vector<std::array<int32_t, 6>> capacity;  ///< what is left of it, once flow has gone
};

/// The set that holds each node: 0 neither, 1 the source, 2 the sink.
using Terminals = std::vector<uint8_t>;

/// Sends the maximum flow from source to sink (Dinic 1970) and takes it off the capacities. True
/// for the nodes from which the sink can still be reached: its side of the minimum cut, the
/// smallest of them.
std::vector<bool> minimum_cut(GridGraph& graph, const Terminals& terminals);

}  // namespace repose::tools::bone_separation
