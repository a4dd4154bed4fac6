#include "repose/adapt/transfer.h"

#include <gtest/gtest.h>

#include <random>

#include "../../layered_patch.h"

namespace repose::adapt {
namespace {

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
  const std::vector<Vec3> carried = Transfer(from, to).carry(given);
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
      Transfer(from, to).carry(std::vector<Vec3>(from.points.position.size(), Vec3::Zero()));
  for (size_t i = 0; i < carried.size(); ++i)
    EXPECT_NEAR(carried[i].z(), to.points.layer[i] / 2.0, 1e-12) << i;
}

std::vector<Vec3> random_field(const model::Model& model, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> number;
  std::vector<Vec3> field(model.points.position.size());
  for (Vec3& v : field) v = {number(generator), number(generator), number(generator)};
  return field;
}

double product(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

/// Models of one patch with some of their deepest points free, as where a bone lets go.
std::array<model::Model, 2> partly_free_patches() {
  const auto up = [](const Vec3&) -> Vec3 { return {0, 0, 1}; };
  std::array<model::Model, 2> models{patch(1, 3, up), patch(3, 5, up)};
  for (model::Model& model : models)
    for (size_t i = 0; i < model.points.set.size(); ++i)
      if (model.points.position[i].x() > 7) model.points.set[i] = model::PointSet::soft_tissue;
  return models;
}

TEST(Transfer, prolongs_what_an_increment_adds) {
  const auto [coarse, fine] = partly_free_patches();
  const Transfer transfer(coarse, fine);
  const std::vector<Vec3> given = random_field(coarse, 1), increment = random_field(coarse, 2);
  std::vector<Vec3> both = given;
  for (size_t i = 0; i < both.size(); ++i) both[i] += increment[i];
  const std::vector<Vec3> before = transfer.carry(given), after = transfer.carry(both),
                          added = transfer.prolong(increment);
  for (size_t i = 0; i < added.size(); ++i) {
    ASSERT_LT((after[i] - before[i] - added[i]).norm(), 1e-13) << i;
    const bool fixed = fine.points.set[i] != model::PointSet::soft_tissue;
    ASSERT_TRUE(!fixed || added[i].isZero(0)) << i;
  }
}

TEST(Transfer, restricts_gradients_by_the_transpose) {
  const auto [coarse, fine] = partly_free_patches();
  for (const auto& [from, to] : {std::pair(&coarse, &fine), std::pair(&fine, &coarse)}) {
    const Transfer transfer(*from, *to);
    const std::vector<Vec3> increment = random_field(*from, 3), gradient = random_field(*to, 4);
    const double there = product(transfer.prolong(increment), gradient);
    EXPECT_NEAR(product(increment, transfer.restrict_gradient(gradient)), there,
                1e-12 * std::abs(there));
  }
}

}  // namespace
}  // namespace repose::adapt
