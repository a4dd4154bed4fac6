#include "repose/adapt/given_skin.h"

#include <gtest/gtest.h>

#include "../../layered_patch.h"

namespace repose::adapt {
namespace {

TEST(GivenSkin, follows_an_affine_motion_and_fades_beyond_the_rim) {
  const test::PatchSize size{
      .columns_x = 13, .columns_y = 9, .layers = 3, .spacing = 4, .thickness = 3};
  model::Model model = test::layered_patch(size);
  for (const auto& [a, b, c] : test::patch_skin(size).triangles)
    model.skin.push_back({a * 3, b * 3, c * 3});
  const auto motion = [](const Vec3& x) -> Vec3 {
    return {1 + 0.1 * x.y(), 0.2 * x.x() - 3, 0.05 * x.x() + 2};
  };
  std::vector<Vec3> displacement;
  for (size_t i = 0; i < model.points.position.size(); ++i) {
    const bool skin = model.points.layer[i] == 0;  // what is beneath has no part
    displacement.push_back(skin ? motion(model.points.position[i]) : Vec3(99, 99, 99));
  }
  const surface::Surface given{
      "given",
      {{20, 16, 0}, {21.3, 14.9, 0.4}, {30, 7, -1}, {58, 16, 0}, {70, 16, 0}},
      {{0, 1, 2}, {2, 3, 4}}};
  const surface::PointData data = displacement_of_given(given, model, displacement);
  ASSERT_EQ(data.vectors.size(), 1u);
  const std::vector<Vec3>& carried = data.vectors[0].values;
  ASSERT_EQ(carried.size(), given.points.size());
  for (int p = 0; p < 3; ++p) {
    EXPECT_LT((carried[p] - motion(given.points[p])).norm(), 0.05) << p;
    EXPECT_EQ(data.fields[0].values[p], 1);
  }
  EXPECT_NEAR(data.fields[0].values[3], 0.5, 1e-9);  // 10 mm of 20 beyond the rim
  EXPECT_LT((carried[3] - 0.5 * motion({48, 16, 0})).norm(), 0.7);
  EXPECT_EQ(data.fields[0].values[4], 0);
  EXPECT_EQ(carried[4], Vec3::Zero());
}

}  // namespace
}  // namespace repose::adapt
