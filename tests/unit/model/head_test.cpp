#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <filesystem>

#include "patches.h"
#include "repose/model/build.h"
#include "repose/model/prism_geometry.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace head_test {

surface::Surface head_surface(const char* name) {
  return surface::weld_and_orient(
      surface::read_surface(std::filesystem::path(REPOSE_HEAD_DATA) / name));
}

/// A real head whose jaw opens by 8°, with n layers.
class Head : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(REPOSE_HEAD_DATA)) GTEST_SKIP() << "no head data";
  }
};

TEST_P(Head, is_a_valid_model_with_positive_prisms) {
  const int layers = GetParam();
  scene::Scene scene = patches::scene_of(layers, {"skull", "mandible"});
  scene.tissue.springs["default"].modulus = 0.02;
  scene.moves[1] = scene::RigidMotion::rotation({0.9995, 0.0038, -0.0327}, {2.4, -208.2, 398.3}, 8);
  const surface::Surface skin = head_surface("face.ply");
  const BuiltModel built =
      build_model(scene, skin, {head_surface("skull.ply"), head_surface("mandible.ply")});
  const Model& model = built.model;
  EXPECT_NO_THROW(validate(model, "head"));
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    ASSERT_GT(model.prisms.rest_volume[m], 0) << m;
    Vec3 corner[6];
    for (int k = 0; k < 6; ++k) corner[k] = model.points.position[model.prisms.points[m][k]];
    for (int k = 0; k < 3; ++k) {  // the wedge map's Jacobian at its six corners
      const Vec3 down = corner[k + 3] - corner[k];
      ASSERT_GT((corner[1] - corner[0]).cross(corner[2] - corner[0]).dot(down), 0) << m;
      ASSERT_GT((corner[4] - corner[3]).cross(corner[5] - corner[3]).dot(down), 0) << m;
    }
  }
  // Of the 184 columns on the rim of face.ply, those over the skull, or where the jaw hardly moves
  EXPECT_EQ(count(model).boundary, 108 * layers);
  EXPECT_GT(built.report.attached, 2000);
  EXPECT_GT(built.report.released, 100);
  EXPECT_EQ(built.report.attached + built.report.free_deep + 108, 4072);
  EXPECT_LT(built.report.shortened, 40);
  EXPECT_GT(built.report.thickness_min, 0.9);
  EXPECT_LT(built.report.thickness_max, 30);
  EXPECT_NEAR(built.report.effective_modulus, 0.02, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Layers, Head, testing::Values(2, 4, 8, 64));

/// Table 1 on the shipped paper-sized head: layers, points, springs, prisms.
class PaperHead : public ::testing::TestWithParam<std::array<int64_t, 4>> {};

TEST_P(PaperHead, has_the_counts_of_table_1_and_positive_prisms) {
  const std::filesystem::path folder = REPOSE_MESHES;
  if (!std::filesystem::exists(folder / "paper_skin.ply")) GTEST_SKIP() << "no paper-sized head";
  const auto& [layers, points, springs, prisms] = GetParam();
  const auto load = [&](const char* name) {
    return surface::weld_and_orient(surface::read_surface(folder / name));
  };
  const scene::Scene scene = patches::scene_of(static_cast<int>(layers), {"skull", "mandible"});
  const BuiltModel built = build_model(scene, load("paper_skin.ply"),
                                       {load("paper_skull.ply"), load("paper_mandible.ply")});
  EXPECT_NO_THROW(validate(built.model, "paper"));
  const Counts counts = count(built.model);
  EXPECT_EQ(counts.points, points);
  EXPECT_EQ(counts.springs, springs);
  EXPECT_EQ(counts.prisms, prisms);
  for (const double v : built.model.prisms.rest_volume) EXPECT_GT(v, 0);
}

using Row = std::array<int64_t, 4>;
INSTANTIATE_TEST_SUITE_P(Table1, PaperHead,
                         testing::Values(Row{2, 954, 5881, 874}, Row{4, 1908, 14941, 2622},
                                         Row{6, 2862, 24001, 4370}));

}  // namespace head_test
}  // namespace repose::model
