#include "repose/adapt/transfer.h"

#include <algorithm>
#include <cmath>

#include "repose/surface/distance.h"
#include "repose/surface/triangle_tree.h"

namespace repose::adapt {

namespace {

using model::Model;

int64_t layers_of(const Model& model) {
  return 1 + *std::max_element(model.points.layer.begin(), model.points.layer.end());
}

/// The skin of a model, vertex = column.
surface::Surface skin_of(const Model& model, int64_t layers) {
  surface::Surface skin{"the skin of the coarse model", {}, {}};
  for (size_t i = 0; i < model.points.position.size(); i += layers)
    skin.points.push_back(model.points.position[i]);
  for (const auto& [a, b, c] : model.skin)
    skin.triangles.push_back({a / layers, b / layers, c / layers});
  return skin;
}

/// Depths of the layers as fractions of the thickness, the same in every column.
std::vector<double> depths_of(const Model& model) {
  const int64_t layers = layers_of(model);
  const auto& x = model.points.position;
  std::vector<double> depths;
  for (int64_t l = 0; l < layers; ++l)
    depths.push_back((x[l] - x[0]).norm() / (x[layers - 1] - x[0]).norm());
  return depths;
}

}  // namespace

Transfer::Transfer(const Model& from, const Model& to)
    : to_(to), from_depths_(depths_of(from)), to_depths_(depths_of(to)) {
  const surface::Surface skin = skin_of(from, layers_of(from));
  const surface::DistanceTree tree(skin);
  for (size_t i = 0; i < to.points.position.size(); i += to_depths_.size()) {
    const auto nearest = tree.nearest(to.points.position[i]);
    const auto& corner = skin.triangles[nearest.triangle];
    const auto& x = skin.points;
    places_.push_back(
        {corner, surface::barycentric({x[corner[0]], x[corner[1]], x[corner[2]]}, nearest.point)});
  }
}

Transfer::Stencil Transfer::stencil(const Place& place, double depth) const {
  const size_t layers = from_depths_.size();
  size_t below = 1;
  while (below + 1 < layers && from_depths_[below] < depth) ++below;
  const double above = from_depths_[below - 1];
  const double share = std::clamp((depth - above) / (from_depths_[below] - above), 0.0, 1.0);
  Stencil stencil{};
  for (size_t k = 0; k < 3; ++k) {
    const auto deeper = static_cast<int64_t>(place.column[k] * layers + below);
    stencil.point[2 * k] = deeper - 1;
    stencil.point[2 * k + 1] = deeper;
    stencil.weight[2 * k] = place.weight[k] * (1 - share);
    stencil.weight[2 * k + 1] = place.weight[k] * share;
  }
  return stencil;
}

bool Transfer::fixed(size_t point) const {
  return to_.points.set[point] != model::PointSet::soft_tissue;
}

std::vector<Vec3> Transfer::carry(const std::vector<Vec3>& displacement) const {
  const model::Points& points = to_.points;
  std::vector<Vec3> found(points.position.size());
  const size_t layers = to_depths_.size();
  const auto at = [&](const Place& place, double depth) {
    const Stencil from = stencil(place, depth);
    Vec3 sum = Vec3::Zero();
    for (size_t k = 0; k < from.point.size(); ++k)
      sum += from.weight[k] * displacement[from.point[k]];
    return sum;
  };
  const auto taken = [&](size_t i) -> Vec3 { return points.target[i] - points.position[i]; };
  for (size_t c = 0; c < places_.size(); ++c) {
    const size_t deepest = (c + 1) * layers - 1;
    Vec3 short_of = Vec3::Zero();
    if (fixed(deepest)) short_of = taken(deepest) - at(places_[c], 1);
    for (size_t l = 0; l < layers; ++l) {
      const size_t i = c * layers + l;
      found[i] =
          fixed(i) ? taken(i) : Vec3(at(places_[c], to_depths_[l]) + to_depths_[l] * short_of);
    }
  }
  return found;
}

}  // namespace repose::adapt
