#include "repose/adapt/given_skin.h"

#include <Eigen/Dense>
#include <algorithm>

#include "repose/meshtools/compare.h"
#include "repose/surface/distance.h"

namespace repose::adapt {

namespace {

constexpr int neighbours = 16;
constexpr double fade = 20;              // mm
constexpr double ridge = 0.01;           // of the mean square extent of the neighbours
constexpr double beyond_farthest = 1.1;  // where the weights end

/// The points of a solved skin.
struct SkinPoints {
  const surface::Surface& skin;
  const std::vector<Vec3>& displacement;
};

/// Those of a model, by themselves.
struct OwnSkin {
  surface::Surface skin;
  std::vector<Vec3> displacement;
};

OwnSkin skin_of(const model::Model& model, const std::vector<Vec3>& displacement) {
  OwnSkin points{{"solved skin", {}, {}}, {}};
  std::vector<int64_t> row(displacement.size(), -1);
  for (size_t i = 0; i < displacement.size(); ++i) {
    if (model.points.layer[i] != 0) continue;
    row[i] = static_cast<int64_t>(points.displacement.size());
    points.skin.points.push_back(model.points.position[i]);
    points.displacement.push_back(displacement[i]);
  }
  for (const auto& [a, b, c] : model.skin)
    points.skin.triangles.push_back({row[a], row[b], row[c]});
  return points;
}

/// The affine motion of the nearest points at `at`, weighted by (1 − d²/h²)².
Vec3 motion_at(const Vec3& at, const SkinPoints& from, const std::vector<int64_t>& near) {
  const double reach = beyond_farthest * (from.skin.points[near.back()] - at).norm() + 1e-9;
  double sum = 0;
  Vec3 middle = Vec3::Zero(), mean = Vec3::Zero();
  std::vector<double> weight;
  for (const int64_t row : near) {
    const double share = (from.skin.points[row] - at).norm() / reach;
    weight.push_back(std::pow(1 - share * share, 2));
    sum += weight.back();
    middle += weight.back() * from.skin.points[row];
    mean += weight.back() * from.displacement[row];
  }
  middle /= sum;
  mean /= sum;
  Mat3 spread = Mat3::Zero(), change = Mat3::Zero();
  for (size_t k = 0; k < near.size(); ++k) {
    const Vec3 beside = from.skin.points[near[k]] - middle;
    spread += weight[k] * beside * beside.transpose();
    change += weight[k] * (from.displacement[near[k]] - mean) * beside.transpose();
  }
  const double extent = spread.trace() / 3;
  spread += ridge * extent * Mat3::Identity();
  Vec3 step = at - middle;
  const double far = std::sqrt(3 * extent / sum);
  if (step.norm() > far) step *= far / step.norm();
  return mean + change * spread.ldlt().solve(step);
}

}  // namespace

surface::PointData displacement_of_given(const surface::Surface& given,
                                         const surface::Surface& skin,
                                         const std::vector<Vec3>& displacement) {
  const SkinPoints from{skin, displacement};
  const surface::PointTree tree(from.skin.points);
  const meshtools::SignedDistance distance(from.skin);
  surface::PointData data;
  data.vectors.push_back({"displacement", {}});
  data.fields.push_back({"solved", {}});
  for (const Vec3& point : given.points) {
    const auto off = distance.at(point);
    const double share =
        off.beyond_rim ? std::clamp(1 - std::abs(off.distance) / fade, 0.0, 1.0) : 1.0;
    data.fields[0].values.push_back(share);
    data.vectors[0].values.push_back(
        share > 0 ? Vec3(share * motion_at(point, from, tree.nearest(point, neighbours)))
                  : Vec3::Zero());
  }
  return data;
}

surface::PointData displacement_of_given(const surface::Surface& given, const model::Model& model,
                                         const std::vector<Vec3>& displacement) {
  const OwnSkin own = skin_of(model, displacement);
  return displacement_of_given(given, own.skin, own.displacement);
}

}  // namespace repose::adapt
