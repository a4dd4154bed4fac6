#include "repose/model/material.h"

#include <gtest/gtest.h>

#include "patches.h"
#include "repose/model/build.h"

namespace repose::model {
namespace material_test {

/// A square of tissue 60 mm wide and 10 mm deep, of such strata, whose skin is stretched so.
Model square_of(const std::vector<scene::Stratum>& strata, double turgor) {
  scene::Scene scene = patches::scene_of(4, {"jaw"});
  scene.tissue.material = scene::Material{.deep = {0.015, 0.45}, .strata = strata, .regions = {}};
  scene.tissue.turgor = turgor;
  const surface::Surface bone = patches::box({-30, -30, -25}, {130, 130, -10});
  return build_model(scene, patches::square(6, 60), {bone}).model;
}

/// Energy of the edges, N mm.
double energy(const Model& m) {
  double sum = 0;
  for (size_t j = 0; j < m.edges.weight.size(); ++j) {
    const auto& [p, q] = m.edges.points[j];
    sum += 0.5 * m.edges.weight[j] * (m.points.position[q] - m.points.position[p]).squaredNorm();
  }
  return sum;
}

TEST(Material, StretchedSkinHasTheEnergyOfItsTensionAndArea) {
  const std::vector<scene::Stratum> skin = {{1.5, {0.08, 0.3}}};
  const double tension = 0.08 * 0.1 * 1.5 / (1 - 0.3);
  EXPECT_NEAR(energy(square_of(skin, 0.1)) - energy(square_of(skin, 0)), tension * 60 * 60, 1e-8);
}

TEST(Material, PrismsTakeTheMeanOfTheStrataBelowOneAnother) {
  const std::vector<scene::Stratum> strata = {{2, {0.08, 0.3}}, {3, {0.003, 0.4}}};
  const Model m = square_of(strata, 0);
  const double first = 0.08 / 2.6, second = 0.003 / 2.8, deep = 0.015 / 2.9;
  const std::array means{0.6 * first + 0.4 * second, 0.5 * second + 0.5 * deep, deep};
  for (size_t k = 0; k < m.prisms.points.size(); ++k)
    EXPECT_NEAR(m.prisms.shear_modulus[k], means[m.points.layer[m.prisms.points[k][0]]], 1e-12);
}

}  // namespace material_test
}  // namespace repose::model
