#include "repose/model/cut.h"

#include <algorithm>
#include <set>

#include "repose/base/error.h"

namespace repose::model {
namespace {

using base::sorted_pair;
using Edge = std::array<int64_t, 2>;

std::set<Edge> torn_edges(const std::vector<char>& torn, const Springs& springs) {
  std::set<Edge> edges;
  for (size_t j = 0; j < torn.size(); ++j)
    if (torn[j]) edges.insert(sorted_pair(springs.points[j][0], springs.points[j][1]));
  return edges;
}

void refuse_torn_off(const Model& model, const std::vector<char>& torn, const std::string& what) {
  std::vector<Edge> left;
  for (size_t j = 0; j < torn.size(); ++j)
    if (!torn[j]) left.push_back(model.springs.points[j]);
  const int64_t row = find_floating(model.points.set, {left});
  if (row < 0) return;
  base::refuse(
      "{}: point {} at {:.4g} mm is torn off: no springs are left between it and what holds the "
      "tissue; give a higher limit or less force",
      what, row, model.points.position[row]);
}

/// Removes the rows of a group of arrays that are gone.
template <class Group>
void keep(Group& group, const std::vector<char>& gone) {
  for_each_array(group, [&](const char*, auto& values) {
    size_t row = 0;
    std::erase_if(values, [&](const auto&) { return gone[row++] != 0; });
  });
}

bool has_torn_edge(const std::array<int64_t, 6>& p, const std::set<Edge>& edges) {
  for (int c = 0; c < 3; ++c) {
    const int d = (c + 1) % 3;
    if (edges.contains(sorted_pair(p[c], p[d])) ||
        edges.contains(sorted_pair(p[c + 3], p[d + 3])) ||
        edges.contains(sorted_pair(p[c], p[c + 3])))
      return true;
  }
  return false;
}

bool has_torn_edge(const Triangle& t, const std::set<Edge>& edges) {
  return edges.contains(sorted_pair(t[0], t[1])) || edges.contains(sorted_pair(t[1], t[2])) ||
         edges.contains(sorted_pair(t[2], t[0]));
}

int64_t remove_prisms(const std::set<Edge>& edges, Prisms& prisms) {
  std::vector<char> gone;
  for (const auto& prism : prisms.points) gone.push_back(has_torn_edge(prism, edges));
  keep(prisms, gone);
  return std::count(gone.begin(), gone.end(), 1);
}

}  // namespace

Tear remove_springs(const std::vector<char>& torn, const std::string& what, Model& model) {
  refuse_torn_off(model, torn, what);
  const std::set<Edge> edges = torn_edges(torn, model.springs);
  keep(model.springs, torn);
  Tear tear;
  tear.prisms = remove_prisms(edges, model.prisms);
  tear.triangles = static_cast<int64_t>(
      std::erase_if(model.skin, [&](const Triangle& t) { return has_torn_edge(t, edges); }));
  return tear;
}

}  // namespace repose::model
