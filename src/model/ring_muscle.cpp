#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>

#include "repose/model/material.h"

namespace repose::model {
namespace {

constexpr double beyond = 10;  // mm, of the muscle's ends from the corners of the mouth
constexpr double behind = 40;  // mm, from stomion, where it ends

/// Stress along the fibers of a prism, N/mm², and their direction.
struct Fibers {
  double tone;
  Vec3 direction;
};

/// The muscle fills the ellipse about the line between the lips that ends at its top and bottom and
/// beyond the corners of the mouth. Fibers run along the lips and turn round their corners,
/// parallel to the skin. The tone falls as 1 − ρ², ρ = 1 on the ellipse.
Fibers fibers_of(const RingMuscle& muscle, const std::array<Vec3, 6>& corners) {
  const Vec3 middle =
      muscle.axes * std::accumulate(corners.begin(), corners.end(), Vec3(Vec3::Zero())) / 6;
  const double half = (muscle.left.x() - muscle.right.x()) / 2, end = half + beyond;
  const double x = middle.x() - (muscle.left.x() + muscle.right.x()) / 2;
  const Vec3& corner = x < 0 ? muscle.right : muscle.left;
  const double along = std::min(std::abs(x) / half, 1.0);
  const double line = muscle.stomion.z() + along * (corner.z() - muscle.stomion.z());
  const double z = middle.z() - line;
  const double height =
      z > 0 ? muscle.top - muscle.stomion.z() : muscle.stomion.z() - muscle.bottom;
  const double share = 1 - x * x / (end * end) - z * z / (height * height);
  if (share <= 0 || middle.y() > muscle.stomion.y() + behind) return {0, Vec3::UnitX()};
  const double straight = 0.8 * half;  // up to where fibers do not turn
  const double turn = std::copysign(std::max(std::abs(x) - straight, 0.0), x) /
                      ((end - straight) * (end - straight));
  const Vec3 ring =
      muscle.axes.transpose() * (turn == 0 ? Vec3(1, 0, 0) : Vec3(-z / (height * height), 0, turn));
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  return {muscle.tone * share, (ring - ring.dot(normal) * normal).normalized()};
}

/// A prism of the muscle.
struct Bundle {
  std::array<int64_t, 6> key;  // its points in the whole model
  size_t prism;
  Fibers fibers;
};

/// The prisms of the muscle in an order that does not depend on ranks.
std::vector<Bundle> bundles_of(const RingMuscle& muscle, const std::vector<int64_t>& row,
                               const Model& model) {
  std::vector<Bundle> bundles;
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    const Fibers fibers = fibers_of(muscle, corners_of(model, m));
    if (fibers.tone == 0) continue;
    bundles.push_back({{}, m, fibers});
    for (int c = 0; c < 6; ++c) bundles.back().key[c] = row[model.prisms.points[m][c]];
  }
  std::ranges::sort(bundles, {}, &Bundle::key);
  return bundles;
}

}  // namespace

RingMuscle ring_muscle(const scene::Scene& scene) {
  if (!scene.anatomy || !scene.tissue.material) return {};
  const scene::Landmarks& landmarks = scene.anatomy->landmarks;
  using scene::find;
  const Vec3 *right = find(landmarks, "mouth_right"), *left = find(landmarks, "mouth_left"),
             *stomion = find(landmarks, "stomion"), *top = find(landmarks, "subnasale"),
             *bottom = find(landmarks, "b_soft");
  if (!right || !left || !stomion || !top || !bottom) return {};
  const Mat3& axes = scene.anatomy->axes;
  return {
      scene.anatomy->tone,      axes * *right, axes * *left, axes * *stomion, axes.row(2).dot(*top),
      axes.row(2).dot(*bottom), axes};
}

void add_tone(const scene::Scene& scene, Model& model) {
  const RingMuscle muscle = ring_muscle(scene);
  if (muscle.tone == 0 || !is_solid(model)) return;
  const size_t points = model.points.position.size();
  add_tone(muscle, base::all_rows(points), static_cast<int64_t>(points), model);
}

void add_tone(const RingMuscle& muscle, const std::vector<int64_t>& row, int64_t owned,
              Model& model) {
  const std::vector<Vec3>& X = model.points.position;
  std::map<std::array<int64_t, 2>, double> added;
  std::vector<Vec3> force(X.size(), Vec3::Zero());
  for (const Bundle& bundle : bundles_of(muscle, row, model)) {
    const std::array<int64_t, 6>& points = model.prisms.points[bundle.prism];
    const Vec3& f = bundle.fibers.direction;
    const auto weights =
        pair_weights(corners_of(model, bundle.prism), bundle.fibers.tone * f * f.transpose())
            .value();
    for (size_t k = 0; k < weights.size(); ++k) {
      const int64_t p = points[prism_pairs[k][0]], q = points[prism_pairs[k][1]];
      added[base::sorted_pair(p, q)] += weights[k];
      const Vec3 pull = weights[k] * (X[q] - X[p]);
      force[p] -= pull;
      force[q] += pull;
    }
  }
  for (size_t j = 0; j < model.edges.points.size(); ++j) {
    const auto [p, q] = model.edges.points[j];
    const auto weight = added.find(base::sorted_pair(p, q));
    if (weight != added.end()) model.edges.weight[j] += weight->second;
  }
  for (int64_t i = 0; i < owned; ++i)
    if (model.points.set[i] == PointSet::soft_tissue) model.points.external_force[i] += force[i];
}

}  // namespace repose::model
