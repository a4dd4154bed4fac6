#include "repose/surface/distance_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "repose/surface/distance.h"
#include "repose/surface/read.h"
#include "shapes.h"

namespace repose::surface {
namespace {

/// A box of 12 triangles from `low` to `high`.
Surface box(const Vec3& low, const Vec3& high) {
  Surface s;
  for (int k = 0; k < 8; ++k)
    s.points.push_back(
        {k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z()});
  s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return s;
}

TEST(DistanceField, is_exact_beside_a_plane_part) {
  const DistanceField field(box({-20, -20, -20}, {20, 20, 20}), 1.0, 6.0, {}, 10);
  for (const double z : {-5.3, -1.0, 0.0, 0.7, 3.1}) {
    const Distance d = field.sample({3.2, -4.7, 20 + z});
    EXPECT_NEAR(d.value, z, 1e-5);
    EXPECT_LT((d.gradient - Vec3::UnitZ()).norm(), 1e-5);
    EXPECT_LT(d.curvature.norm(), 1e-5);
  }
}

TEST(DistanceField, rounds_a_convex_edge_by_less_than_half_a_spacing_and_nothing_else_much) {
  const DistanceField field(box({-20, -20, -20}, {20, 20, 20}), 1.0, 6.0, {}, 10);
  const double at_edge = field.value({20, 20, 0.3});
  EXPECT_GT(at_edge, 0.05);
  EXPECT_LT(at_edge, 0.5);
  EXPECT_DOUBLE_EQ(field.value({0, 0, 40}), 6.0);
}

TEST(DistanceField, is_not_misled_by_slivers_whose_normals_say_little) {
  for (const double y : {-1e-7, 0.0, 1e-7})
    for (const double z : {-1e-7, 0.0, 1e-7}) {
      Surface s = box({-20, -20, -20}, {20, 20, 20});
      const auto middle = static_cast<int64_t>(s.points.size());  // of the edge from 4 to 5
      s.points.push_back({0, -20 + y, 20 + z});
      *std::find(s.triangles.begin(), s.triangles.end(), Triangle{1, 5, 4}) = {1, 5, middle};
      s.triangles.push_back({1, middle, 4});
      s.triangles.push_back({5, 4, middle});
      const DistanceField field(s, 1.0, 6.0, {}, 10);
      for (double beyond = 0.5; beyond < 12; beyond += 0.5) {
        EXPECT_GT(field.value({0, -20 - beyond, 20 + beyond}), 0) << y << " " << z << " " << beyond;
        EXPECT_LT(field.value({0, -20 + beyond, 20 - beyond}), 0) << y << " " << z << " " << beyond;
      }
    }
}

TEST(DistanceField, derivatives_are_those_of_its_value) {
  const DistanceField field(box({-9, -7, -8}, {9, 7, 8}), 0.8, 5.0, {}, 0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> within(-1, 1);
  for (int n = 0; n < 200; ++n) {
    const Vec3 at(11 * within(random), 9 * within(random), 10 * within(random));
    const Distance d = field.sample(at);
    constexpr double step = 1e-4;
    for (int a = 0; a < 3; ++a) {
      const Distance above = field.sample(at + step * Vec3::Unit(a)),
                     below = field.sample(at - step * Vec3::Unit(a));
      EXPECT_NEAR((above.value - below.value) / (2 * step), d.gradient[a], 1e-6);
      EXPECT_LT(((above.gradient - below.gradient) / (2 * step) - d.curvature.col(a)).norm(), 1e-3);
    }
  }
}

TEST(DistanceField, follows_the_jaw_of_a_head_inside_and_out) {
  const Surface jaw = read_surface(std::string(REPOSE_MESHES) + "/head_mandible.ply");
  const DistanceField field(jaw, 1.0, 6.0, {}, 0);
  const DistanceTree tree(jaw);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> shift(-4, 4);
  double worst = 0, sum = 0;
  int count = 0;
  for (size_t p = 0; p < jaw.points.size(); p += 3) {
    const Vec3 at = jaw.points[p] + Vec3(shift(random), shift(random), shift(random));
    const double exact = tree.nearest(at).distance * (tree.contains(at) ? -1 : 1);
    if (exact > 4) continue;
    const double error = std::abs(field.value(at) - exact);
    worst = std::max(worst, error);
    sum += error;
    ++count;
  }
  EXPECT_LT(worst, 0.7);
  EXPECT_LT(sum / count, 0.05);
}

}  // namespace
}  // namespace repose::surface
