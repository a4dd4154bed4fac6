#include "minimum_cut.h"

#include <algorithm>

namespace repose::tools::bone_separation {
namespace {

constexpr uint8_t source = 1, sink = 2;

class Flow {
 public:
  Flow(GridGraph& graph, const Terminals& terminals)
      : graph_(graph), terminals_(terminals), distance_(terminals.size()), arc_(terminals.size()) {}

  /// Numbers the nodes by their distance from the source, to the sink; false if it is cut off.
  bool measure() {
    std::fill(distance_.begin(), distance_.end(), -1);
    std::fill(arc_.begin(), arc_.end(), uint8_t{0});
    queue_.clear();
    for (size_t node = 0; node < terminals_.size(); ++node)
      if (terminals_[node] == source) {
        distance_[node] = 0;
        queue_.push_back(static_cast<int32_t>(node));
      }
    for (size_t next = 0; next < queue_.size(); ++next) {
      const int32_t node = queue_[next];
      if (terminals_[node] == sink) return true;
      for (int d = 0; d < 6; ++d) {
        const int32_t other = graph_.neighbor[node][d];
        if (other < 0 || distance_[other] >= 0 || graph_.capacity[node][d] == 0) continue;
        distance_[other] = distance_[node] + 1;
        queue_.push_back(other);
      }
    }
    return false;
  }

  /// Fills all shortest ways from the source to the sink.
  void fill() {
    for (size_t node = 0; node < terminals_.size(); ++node)
      if (terminals_[node] == source) fill_from(static_cast<int32_t>(node));
  }

 private:
  struct Step {
    int32_t node;
    int direction;
  };

  void fill_from(int32_t start) {
    std::vector<Step> path;
    for (int32_t node = start;;) {
      if (terminals_[node] == sink) {
        send(path);
        while (graph_.capacity[path.back().node][path.back().direction] > 0) path.pop_back();
        node = path.back().node;
        path.pop_back();
      } else if (const int d = onward(node); d < 6) {
        path.push_back({node, d});
        node = graph_.neighbor[node][d];
      } else {
        if (path.empty()) return;
        node = path.back().node;
        ++arc_[node];
        path.pop_back();
      }
    }
  }

  /// The next direction that leads nearer to the sink; 6: none.
  int onward(int32_t node) {
    uint8_t& d = arc_[node];
    for (; d < 6; ++d) {
      const int32_t other = graph_.neighbor[node][d];
      if (other >= 0 && graph_.capacity[node][d] > 0 && distance_[other] == distance_[node] + 1)
        break;
    }
    return d;
  }

  void send(const std::vector<Step>& path) {
    int32_t maximum = graph_.capacity[path[0].node][path[0].direction];
    for (const auto& [node, d] : path) maximum = std::min(maximum, graph_.capacity[node][d]);
    for (const auto& [node, d] : path) {
      graph_.capacity[node][d] -= maximum;
      graph_.capacity[graph_.neighbor[node][d]][d ^ 1] += maximum;
    }
  }

  GridGraph& graph_;
  const Terminals& terminals_;
  std::vector<int32_t> distance_, queue_;
  std::vector<uint8_t> arc_;
};

}  // namespace

std::vector<bool> minimum_cut(GridGraph& graph, const Terminals& terminals) {
  Flow flow(graph, terminals);
  while (flow.measure()) flow.fill();
  std::vector<bool> side(terminals.size());
  std::vector<int32_t> reached;
  for (size_t node = 0; node < terminals.size(); ++node)
    if (terminals[node] == sink) reached.push_back(static_cast<int32_t>(node));
  for (const int32_t node : reached) side[node] = true;
  for (size_t next = 0; next < reached.size(); ++next)
    for (int d = 0; d < 6; ++d) {
      const int32_t other = graph.neighbor[reached[next]][d];
      if (other < 0 || side[other] || graph.capacity[other][d ^ 1] == 0) continue;
      side[other] = true;
      reached.push_back(other);
    }
  return side;
}

}  // namespace repose::tools::bone_separation
