#include "skin.h"

#include "repose/adapt/transfer.h"

namespace repose::tradeoff {

Skin::Skin(const model::Model& reference, const std::vector<Vec3>& rest) : reference_(reference) {
  std::vector<int64_t> place(rest.size(), -1);
  for (size_t i = 0; i < rest.size(); ++i) {
    if (reference.points.layer[i] > 0) continue;
    place[i] = static_cast<int64_t>(row_.size());
    row_.push_back(static_cast<int64_t>(i));
    rest_.push_back(rest[i]);
  }
  for (const Triangle& t : reference.skin)
    triangles_.push_back({place[t[0]], place[t[1]], place[t[2]]});
}

std::vector<double> Skin::distances(const model::Model& model,
                                    const std::vector<Vec3>& position) const {
  std::vector<Vec3> displacement;
  for (size_t i = 0; i < position.size(); ++i)
    displacement.push_back(position[i] - model.points.position[i]);
  const std::vector<Vec3> carried = adapt::transfer(model, reference_, displacement);
  std::vector<double> distance;
  for (size_t v = 0; v < row_.size(); ++v)
    distance.push_back((reference_.points.position[row_[v]] + carried[row_[v]] - rest_[v]).norm());
  return distance;
}

}  // namespace repose::tradeoff
