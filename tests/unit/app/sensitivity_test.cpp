#include "app/sensitivity.h"

#include <gtest/gtest.h>

namespace repose::app {
namespace {

TEST(Variations, ALowerPoissonsRatioIsThatOfEachMaterial) {
  scene::Scene scene;
  scene.tissue.material.emplace();
  scene.tissue.material->deep.poisson = 0.45;
  scene.tissue.material->strata.push_back({1.5, {.young = 1, .poisson = 0.48}});
  scene.tissue.material->regions.resize(1);
  scene.tissue.material->regions[0].elasticity = {.young = 1, .poisson = 0.3};
  for (const Variation& variation : variations(scene)) {
    if (!variation.name.starts_with("a lower Poisson's ratio")) continue;
    const scene::Material& material = *variation.scene.tissue.material;
    EXPECT_NEAR(material.deep.poisson, 0.40, 1e-12);
    EXPECT_NEAR(material.strata[0].elasticity.poisson, 0.45, 1e-12);
    EXPECT_NEAR(material.regions[0].elasticity.poisson, 0.25, 1e-12);
    return;
  }
  FAIL() << "no such variation";
}

}  // namespace
}  // namespace repose::app
