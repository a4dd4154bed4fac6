#include <gtest/gtest.h>

#include <algorithm>

#include "../mechanics/states.h"
#include "patches.h"
#include "repose/model/build.h"
#include "repose/model/material.h"

namespace repose::model {
namespace ring_muscle_test {

const std::array<Vec3, 6> wedge = {Vec3(0, 0, 0),   Vec3(2, 0.1, 0), Vec3(0.2, 1.5, 0.1),
                                   Vec3(0.1, 0, 1), Vec3(2, 0, 1.2), Vec3(0, 1.6, 0.9)};

/// Free prisms of the given corners without material of their own.
Model prisms_at(const std::vector<std::array<Vec3, 6>>& places) {
  Model model;
  for (size_t m = 0; m < places.size(); ++m) {
    std::array<int64_t, 6> points{};
    for (int c = 0; c < 6; ++c) {
      points[c] = static_cast<int64_t>(model.points.position.size());
      model.points.position.push_back(places[m][c]);
      model.points.set.push_back(PointSet::soft_tissue);
      model.points.external_force.push_back(Vec3::Zero());
    }
    model.prisms.points.push_back(points);
    for (int a = 0; a < 6; ++a)
      for (int b = a + 1; b < 6; ++b) model.edges.points.push_back({points[a], points[b]});
  }
  model.edges.weight.assign(model.edges.points.size(), 0.0);
  return model;
}

/// A muscle about the origin, 50 mm wide between the corners.
RingMuscle muscle_of(double tone) { return {tone, {-25, 0, 0}, {25, 0, 0}, {0, 0, 0}, 20, -15}; }

/// Energy of edges and external forces at displaced points, N mm.
double energy(const Model& m, const std::vector<Vec3>& x) {
  double sum = 0;
  for (size_t j = 0; j < m.edges.weight.size(); ++j) {
    const auto& [p, q] = m.edges.points[j];
    sum += 0.5 * m.edges.weight[j] * (x[q] - x[p]).squaredNorm();
  }
  for (size_t i = 0; i < x.size(); ++i) sum -= m.points.external_force[i].dot(x[i]);
  return sum;
}

void add_tone_to(Model& model) {
  const size_t points = model.points.position.size();
  add_tone(muscle_of(0.004), base::all_rows(points), static_cast<int64_t>(points), model);
}

/// Energy of a deformation gradient over that of none.
double energy_of(const Model& model, const Mat3& F) {
  std::vector<Vec3> x = model.points.position;
  for (Vec3& at : x) at = F * at;
  return energy(model, x) - energy(model, model.points.position);
}

std::array<Vec3, 6> moved(const Vec3& by) {
  std::array<Vec3, 6> corners = wedge;
  for (Vec3& corner : corners) corner += by;
  return corners;
}

double volume_of(const std::array<Vec3, 6>& corners) { return prism_volume(corners.data()); }

/// In the middle of the mouth fibers run along x, in the plane of the skin.
TEST(RingMuscle, HasTheEnergyOfItsStretch) {
  const Vec3 middle = Vec3(1.0, 0.8, 0.5);
  Model model = prisms_at({moved(-middle)});
  add_tone_to(model);
  const std::array<Vec3, 6> corners = corners_of(model, 0);
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  const Vec3 f = (Vec3::UnitX() - normal.x() * normal).normalized();
  test::Random random(3);
  for (int state = 0; state < 5; ++state) {
    Mat3 F;
    for (double& entry : F.reshaped()) entry = random();
    const double expected = 0.5 * 0.004 * volume_of(corners) * (F * f - f).squaredNorm();
    EXPECT_NEAR(energy_of(model, F), expected, 0.01 * expected) << "ρ² of the prism is below 0.01";
  }
}

TEST(RingMuscle, IsBalancedAsItIsRecorded) {
  Model model = prisms_at({moved({0, 0, 3}), moved({-20, 0, -9}), moved({26, 0, 1})});
  add_tone_to(model);
  std::vector<Vec3> force = model.points.external_force;
  double largest = 0;
  for (const Vec3& f : force) largest = std::max(largest, f.norm());
  EXPECT_GT(largest, 1e-4);
  for (size_t j = 0; j < model.edges.weight.size(); ++j) {
    const auto& [p, q] = model.edges.points[j];
    const Vec3 pull = model.edges.weight[j] * (model.points.position[q] - model.points.position[p]);
    force[p] += pull;
    force[q] -= pull;
  }
  for (const Vec3& f : force) EXPECT_LT(f.norm(), 1e-15);
}

/// Stretch along z costs nothing between the lips, and nearly all beyond a corner of the mouth.
TEST(RingMuscle, RunsRoundTheMouth) {
  const Mat3 along_x = Vec3(1.5, 1, 1).asDiagonal(), along_z = Vec3(1, 1, 1.5).asDiagonal();
  // A prism of skin that faces forward, −y.
  const std::array<Vec3, 6> front = {Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(1, 0, 0),
                                     Vec3(0, 1, 0), Vec3(0, 1, 1), Vec3(1, 1, 0)};
  const auto at = [&](const Vec3& by) {
    std::array<Vec3, 6> corners = front;
    for (Vec3& corner : corners) corner += by;
    Model model = prisms_at({corners});
    add_tone_to(model);
    return model;
  };
  const Model middle = at({0, 0, 4}), low = at({0, 0, -5}), beyond = at({31, 0, 0});
  EXPECT_NEAR(energy_of(middle, along_z), 0, 1e-15);
  EXPECT_GT(energy_of(low, along_x), 1e-5);
  EXPECT_LT(energy_of(low, along_x), energy_of(at({0, 0, -1}), along_x)) << "farther from the lips";
  EXPECT_GT(energy_of(beyond, along_z), 20 * energy_of(beyond, along_x));
  for (const Vec3& outside : {Vec3(0, 0, 25), Vec3(0, 0, -16), Vec3(36, 0, 0), Vec3(0, 41, 0)})
    EXPECT_EQ(energy_of(at(outside), along_x), 0) << outside.transpose();
}

TEST(RingMuscle, PartsOfAModelGetTheSameBits) {
  std::vector<std::array<Vec3, 6>> places;
  for (int k = 0; k < 4; ++k) places.push_back(wedge);
  Model model = prisms_at(places);
  // Four prisms that share their first triangle with points 0, 1 and 2.
  for (auto& points : model.prisms.points) points[0] = 0, points[1] = 1, points[2] = 2;
  for (size_t i = 3; i < model.points.position.size(); ++i)
    model.points.position[i] += 0.01 * static_cast<double>(i) * Vec3(0, 0.3, 0.1);
  Model part = model;
  std::swap(part.prisms.points[0], part.prisms.points[3]);
  std::vector<int64_t> row(model.points.position.size());
  for (size_t i = 0; i < row.size(); ++i) row[i] = static_cast<int64_t>(i) + 7;
  add_tone_to(model);
  add_tone(muscle_of(0.004), row, 3, part);
  EXPECT_EQ(part.edges.weight, model.edges.weight);
  for (size_t i = 0; i < row.size(); ++i)
    EXPECT_EQ(part.points.external_force[i],
              i < 3 ? model.points.external_force[i] : Vec3(Vec3::Zero()));
}

TEST(RingMuscle, HeldPointsGetNoForce) {
  Model model = prisms_at({wedge});
  model.points.set[4] = PointSet::bone;
  add_tone_to(model);
  EXPECT_EQ(model.points.external_force[4], Vec3(Vec3::Zero()));
  EXPECT_NE(model.points.external_force[5], Vec3(Vec3::Zero()));
}

TEST(RingMuscle, NeedsASolidAndItsLandmarks) {
  scene::Scene scene = patches::scene_of(4, {"jaw"});
  scene.anatomy = scene::AnatomyPlan{};
  scene.anatomy->landmarks = {{"mouth_right", {-25, 0, 0}},
                              {"mouth_left", {25, 0, 0}},
                              {"stomion", {0, -10, 0}},
                              {"subnasale", {0, -10, 20}},
                              {"b_soft", {0, -8, -15}}};
  EXPECT_EQ(ring_muscle(scene).tone, 0) << "springs";
  scene.tissue.material = scene::Material{};
  EXPECT_EQ(ring_muscle(scene).tone, scene.anatomy->tone);
  EXPECT_EQ(ring_muscle(scene).bottom, -15);
  scene.anatomy->landmarks.erase("subnasale");
  EXPECT_EQ(ring_muscle(scene).tone, 0);
}

}  // namespace ring_muscle_test
}  // namespace repose::model
