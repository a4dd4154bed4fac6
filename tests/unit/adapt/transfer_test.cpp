#include "repose/adapt/transfer.h"

#include <gtest/gtest.h>

#include <random>

#include "../../layered_patch.h"

namespace repose::adapt {
namespace transfer_test {

/// A patch of 12 mm × 8 mm and 4 mm depth whose fixed points are taken by `displacement`.
template <class Field>
model::Model patch(int64_t finer, int64_t layers, const Field& displacement) {
  const test::PatchSize size{.columns_x = 6 * finer + 1,
                             .columns_y = 4 * finer + 1,
                             .layers = layers,
                             .spacing = 2.0 / static_cast<double>(finer),
                             .thickness = 4.0 / static_cast<double>(layers - 1)};
  model::Model model = test::layered_patch(size);
  for (const auto& [a, b, c] : test::patch_skin(size).triangles)
    model.skin.push_back({a * layers, b * layers, c * layers});
  for (size_t i = 0; i < model.points.position.size(); ++i)
    if (model.points.set[i] != model::PointSet::soft_tissue)
      model.points.target[i] += displacement(model.points.position[i]);
  return model;
}

template <class Field>
void expect_carried(const model::Model& from, const model::Model& to, const Field& displacement) {
  std::vector<Vec3> given;
  for (const Vec3& x : from.points.position) given.push_back(displacement(x));
  const std::vector<Vec3> carried = transfer(from, to, given);
  ASSERT_EQ(carried.size(), to.points.position.size());
  for (size_t i = 0; i < carried.size(); ++i)
    EXPECT_LT((carried[i] - displacement(to.points.position[i])).norm(), 1e-12) << i;
}

TEST(Transfer, carries_linear_fields_exactly_between_meshes_and_layers) {
  const auto linear = [](const Vec3& x) -> Vec3 {
    return {1 + 0.3 * x.x() - 0.1 * x.z(), 0.2 * x.y() + 0.4 * x.z(), 0.1 * x.x() - 2};
  };
  const model::Model coarse = patch(1, 3, linear), fine = patch(3, 5, linear);
  expect_carried(coarse, fine, linear);
  expect_carried(fine, coarse, linear);
}

TEST(Transfer, takes_fixed_points_where_they_go_and_what_is_above_in_proportion) {
  const auto none = [](const Vec3&) -> Vec3 { return Vec3::Zero(); };
  const auto up = [](const Vec3&) -> Vec3 { return {0, 0, 1}; };
  const model::Model from = patch(1, 3, none), to = patch(2, 3, up);
  const std::vector<Vec3> carried =
      transfer(from, to, std::vector<Vec3>(from.points.position.size(), Vec3::Zero()));
  for (size_t i = 0; i < carried.size(); ++i)
    EXPECT_NEAR(carried[i].z(), to.points.layer[i] / 2.0, 1e-12) << i;
}

}  // namespace transfer_test
}  // namespace repose::adapt
