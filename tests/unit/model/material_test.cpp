#include "repose/model/material.h"

#include <gtest/gtest.h>

#include "patches.h"
#include "repose/model/build.h"

namespace repose::model {
namespace {

/// A square of tissue, 60 mm wide, under a skin of 1.5 mm and 0.08 N/mm² that is stretched so.
Model stretched(double turgor) {
  scene::Scene scene = patches::scene_of(4, {"jaw"});
  scene.tissue.material =
      scene::Material{.deep = {0.015, 0.45}, .strata = {{1.5, {0.08, 0.3}}}, .regions = {}};
  scene.tissue.turgor = turgor;
  return build_model(scene, patches::square(6, 60),
                     {patches::box({-30, -30, -25}, {130, 130, -10})})
      .model;
}

/// Of the edges, N mm.
double energy(const Model& m) {
  double sum = 0;
  for (size_t j = 0; j < m.edges.weight.size(); ++j) {
    const auto& [p, q] = m.edges.points[j];
    sum += 0.5 * m.edges.weight[j] * (m.points.position[q] - m.points.position[p]).squaredNorm();
  }
  return sum;
}

TEST(Material, StretchedSkinHasTheEnergyOfItsTensionAndArea) {
  const double tension = 0.08 * 0.1 * 1.5 / (1 - 0.3);
  EXPECT_NEAR(energy(stretched(0.1)) - energy(stretched(0)), tension * 60 * 60, 1e-8);
}

}  // namespace
}  // namespace repose::model
