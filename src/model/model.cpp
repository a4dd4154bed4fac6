#include "repose/model/model.h"

#include "repose/surface/edges.h"

namespace repose::model {

Counts count(const Model& model) {
  Counts c;
  c.points = static_cast<int64_t>(model.points.position.size());
  for (const PointSet set : model.points.set) {
    c.soft += set == PointSet::soft_tissue;
    c.boundary += set == PointSet::boundary;
    c.bone += set == PointSet::bone;
    c.held += set == PointSet::held;
  }
  c.springs = static_cast<int64_t>(model.springs.points.size());
  c.prisms = static_cast<int64_t>(model.prisms.points.size());
  c.edges = static_cast<int64_t>(model.edges.points.size());
  return c;
}

ModelRows all_rows(const Model& model) {
  return {count(model), is_solid(model),     static_cast<int64_t>(model.contact.pairs.point.size()),
          model.points, model.springs,       model.prisms,
          model.edges,  model.contact.pairs, outward_normals(model)};
}

int64_t find_floating(const std::vector<PointSet>& set,
                      std::initializer_list<std::span<const std::array<int64_t, 2>>> ends) {
  const auto points = static_cast<int64_t>(set.size());
  surface::UnionFind parts(points);
  for (const auto pairs : ends)
    for (const auto& [p, q] : pairs) parts.unite(p, q);
  std::vector<bool> held(set.size(), false);
  for (int64_t i = 0; i < points; ++i)
    if (set[i] != PointSet::soft_tissue) held[parts.find(i)] = true;
  for (int64_t i = 0; i < points; ++i)
    if (!held[parts.find(i)]) return i;
  return -1;
}

}  // namespace repose::model
