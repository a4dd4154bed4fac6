#include "repose/adapt/transfer.h"

#include <algorithm>

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

struct Place {
  Triangle column;  // of the model
  Vec3 weight;      // of each, sum 1
};

std::vector<Place> places_on(const surface::Surface& skin, const Model& to, size_t layers) {
  const surface::DistanceTree tree(skin);
  std::vector<Place> places;
  for (size_t i = 0; i < to.points.position.size(); i += layers) {
    const auto nearest = tree.nearest(to.points.position[i]);
    const Triangle& columns = skin.triangles[nearest.triangle];
    places.push_back(
        {columns, surface::barycentric(base::pick(skin.points, columns), nearest.point)});
  }
  return places;
}

/// Values of the points of a model with layers at these depths, at a place and depth.
Vec3 interpolate(const std::vector<Vec3>& values, const std::vector<double>& depths,
                 const Place& place, double depth) {
  size_t below = 1;
  while (below + 1 < depths.size() && depths[below] < depth) ++below;
  const double above = depths[below - 1];
  const double share = std::clamp((depth - above) / (depths[below] - above), 0.0, 1.0);
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const size_t deeper = place.column[k] * depths.size() + below;
    sum += place.weight[k] * (1 - share) * values[deeper - 1];
    sum += place.weight[k] * share * values[deeper];
  }
  return sum;
}

}  // namespace

std::vector<Vec3> transfer(const Model& from, const Model& to,
                           const std::vector<Vec3>& displacement) {
  const std::vector<double> from_depths = depths_of(from), depths = depths_of(to);
  const size_t layers = depths.size();
  const std::vector<Place> places = places_on(skin_of(from, layers_of(from)), to, layers);
  std::vector<Vec3> found(to.points.position.size());
  const auto fixed = [&](size_t i) { return to.points.set[i] != model::PointSet::soft_tissue; };
  const auto taken = [&](size_t i) -> Vec3 { return to.points.target[i] - to.points.position[i]; };
  for (size_t c = 0; c < places.size(); ++c) {
    const auto at = [&](double depth) {
      return interpolate(displacement, from_depths, places[c], depth);
    };
    const size_t deepest = (c + 1) * layers - 1;
    Vec3 short_of = Vec3::Zero();
    if (fixed(deepest)) short_of = taken(deepest) - at(1);
    for (size_t l = 0; l < layers; ++l) {
      const size_t i = c * layers + l;
      found[i] = fixed(i) ? taken(i) : Vec3(at(depths[l]) + depths[l] * short_of);
    }
  }
  return found;
}

}  // namespace repose::adapt
