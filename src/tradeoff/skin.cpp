#include "skin.h"

#include <Eigen/Dense>

#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/surface/distance.h"

namespace repose::tradeoff {

namespace {

/// The skin of a model as a surface of its own, and the model's row of each of its points.
struct ModelSkin {
  surface::Surface surface;
  std::vector<int64_t> row;
};

ModelSkin skin_of(const model::Model& model) {
  ModelSkin skin;
  std::vector<int64_t> place(model.points.position.size(), -1);
  for (size_t i = 0; i < place.size(); ++i)
    if (model.points.layer[i] == 0) {
      place[i] = static_cast<int64_t>(skin.row.size());
      skin.row.push_back(static_cast<int64_t>(i));
      skin.surface.points.push_back(model.points.position[i]);
    }
  for (const Triangle& t : model.skin)
    skin.surface.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  return skin;
}

/// The weights of a point of a triangle's plane.
Vec3 barycentric(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point) {
  Eigen::Matrix<double, 3, 2> edges;
  edges << b - a, c - a;
  const Eigen::Vector2d w = edges.colPivHouseholderQr().solve(point - a);
  return {1 - w.sum(), w[0], w[1]};
}

}  // namespace

model::Model build(const scene::Scene& scene, const Way& way) {
  const bool by_layer = !scene.tissue.depths.empty() || !scene.tissue.mass.empty();
  if (way.layers != scene.tissue.layers && by_layer)
    base::refuse("{}: tissue.depths and tissue.mass are for {} layers; -layers cannot vary them",
                 scene.file.string(), scene.tissue.layers);
  if (!scene.incisions.empty())
    base::refuse("{}: incisions are not compared; take the key out for this study",
                 scene.file.string());
  scene::Scene wanted = scene;
  wanted.tissue.layers = way.layers;
  return model::build_model(wanted).model;
}

Skin::Skin(const model::Model& reference, const std::vector<Vec3>& rest) {
  ModelSkin skin = skin_of(reference);
  for (const int64_t row : skin.row) rest_.push_back(rest[row]);
  initial_ = std::move(skin.surface.points);
  triangles_ = std::move(skin.surface.triangles);
}

std::vector<double> Skin::distances(const model::Model& model,
                                    const std::vector<Vec3>& position) const {
  const ModelSkin skin = skin_of(model);
  std::vector<Vec3> moved;
  for (const int64_t row : skin.row) moved.push_back(position[row] - model.points.position[row]);
  std::vector<double> distance;
  const surface::DistanceTree tree(skin.surface);
  for (size_t v = 0; v < initial_.size(); ++v) {
    const auto nearest = tree.nearest(initial_[v]);
    const auto& [a, b, c] = skin.surface.triangles[nearest.triangle];
    const auto& x = skin.surface.points;
    const Vec3 w = barycentric(x[a], x[b], x[c], nearest.point);
    const Vec3 shift = w[0] * moved[a] + w[1] * moved[b] + w[2] * moved[c];
    distance.push_back((initial_[v] + shift - rest_[v]).norm());
  }
  return distance;
}

}  // namespace repose::tradeoff
