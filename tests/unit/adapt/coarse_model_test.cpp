#include "repose/adapt/coarse_model.h"

#include <gtest/gtest.h>

#include "repose/adapt/grid_sequence.h"
#include "repose/meshtools/remesh.h"

namespace repose::adapt {
namespace coarse_model_test {

/// The shipped head whose jaw advances: 2000 skin vertices, 4 layers.
model::Anatomy head() {
  return model::load_anatomy(
      scene::read_scene(std::filesystem::path(REPOSE_MESHES) / "head_springs_advance.yaml"));
}

void give(model::Anatomy& anatomy, const scene::SpringRule& rule) {
  anatomy.scene.tissue.springs = {{"default", rule}};
}

TEST(CoarseModel, has_the_modulus_of_the_fine_one_at_any_resolution) {
  model::Anatomy anatomy = head();
  for (const bool constants : {false, true}) {
    if (constants)
      give(anatomy, {.stiffness = 2.0, .modulus = {}, .law = {}, .reference = {}});
    else
      give(anatomy, {.stiffness = {}, .modulus = 0.05, .law = {}, .reference = 0.0});
    const model::Model fine = model::build_model(anatomy).model;
    for (const Resolution& resolution : {Resolution{9, 0}, Resolution{9, 3}, Resolution{0, 2}}) {
      const model::Model coarse = coarse_model(anatomy, fine, resolution).model;
      EXPECT_NO_THROW(model::validate(coarse, "coarse"));
      // Constants are moduli that differ from layer to layer, whose shares of the volume differ.
      EXPECT_NEAR(model::effective_modulus(coarse) / model::effective_modulus(fine), 1,
                  constants ? 1e-3 : 1e-9);
    }
  }
}

TEST(CoarseModel, at_the_resolution_of_the_scene_is_its_model) {
  model::Anatomy anatomy = head();
  give(anatomy, {.stiffness = {}, .modulus = 0.05, .law = scene::Law::quadratic, .reference = 0.0});
  anatomy.scene.tissue.springs["layer 0"].modulus = 0.2;  // layers are not alike
  EXPECT_FALSE(layers_are_free(anatomy.scene.tissue));
  const model::Model fine = model::build_model(anatomy).model;
  const model::Model same = coarse_model(anatomy, fine, {}).model;
  ASSERT_EQ(same.springs.points, fine.springs.points);
  ASSERT_EQ(same.springs.exponent, fine.springs.exponent);
  for (size_t j = 0; j < fine.springs.points.size(); ++j) {
    ASSERT_NEAR(same.springs.stiffness[j] / fine.springs.stiffness[j], 1, 1e-9) << j;
    ASSERT_NEAR(same.springs.reference[j] / fine.springs.reference[j], 1, 1e-9) << j;
  }
}

TEST(Resolutions, get_coarser_to_a_least_number_of_columns) {
  const model::Anatomy anatomy = head();
  const std::vector<Resolution> levels = compared_resolutions(anatomy, 100000);
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_EQ(levels[0].layers, anatomy.scene.tissue.layers - 1);
  EXPECT_TRUE(compared_resolutions(anatomy, 400).empty());
}

TEST(Remesh, by_the_even_edge_keeps_the_number_of_triangles) {
  const surface::Surface skin = head().skin;
  const surface::Surface same = meshtools::remesh(skin, meshtools::even_edge(skin));
  EXPECT_NEAR(static_cast<double>(same.triangles.size()) / skin.triangles.size(), 1, 0.2);
}

}  // namespace coarse_model_test
}  // namespace repose::adapt
