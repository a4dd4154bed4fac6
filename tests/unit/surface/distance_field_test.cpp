#include "repose/surface/distance_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "repose/meshtools/osteotomy.h"
#include "repose/surface/distance.h"
#include "repose/surface/read.h"
#include "shapes.h"

namespace repose::surface {
namespace distance_field_test {

/// A box of 12 triangles from `low` to `high`.
Surface box(const Vec3& low, const Vec3& high) {
  Surface s{"box", {}, {}};
  for (int k = 0; k < 8; ++k)
    s.points.push_back(
        {k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z()});
  s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return s;
}

constexpr double spacings[] = {1.3, 1.5, 2, 2.2, 2.5, 2.7791242, 2.9, 3.1, 3.7, 5};
constexpr double reach = 6;

/// Compares every `stride`-th grid point with CGAL's distance and parity of crossings.
void expect_exact(const Surface& surface, const DistanceTree& tree, double spacing, int stride) {
  const DistanceField field(surface, spacing, reach);
  const auto [nx, ny, nz] = field.grid_points();
  int64_t wrong_signs = 0, inside = 0;
  double largest_error = 0;
  for (int64_t n = 0; n < nx * ny * nz; n += stride) {
    const DistanceField::Index at{n % nx, n / nx % ny, n / nx / ny};
    const Vec3 point = field.grid_point(at);
    const double distance = tree.nearest(point).distance, value = field.value_at(at);
    const bool contained = distance < 1e-6 ? value < 0 : tree.contains(point);
    inside += contained;
    wrong_signs += (value < 0) != contained;
    const double exact = std::min(contained ? -distance : distance, reach);
    largest_error = std::max(largest_error, std::abs(value - exact) / (1 + std::abs(exact)));
  }
  EXPECT_EQ(wrong_signs, 0) << surface.name << ", spacing " << spacing;
  EXPECT_LT(largest_error, 1e-7) << surface.name << ", spacing " << spacing;
  EXPECT_GT(inside, 0) << surface.name << ", spacing " << spacing;
}

void expect_exact(const Surface& surface, int stride = 1) {
  const DistanceTree tree(surface);
  for (const double spacing : spacings) expect_exact(surface, tree, spacing, stride);
}

Surface mandible() { return read_surface(std::string(REPOSE_MESHES) + "/head_mandible.ply"); }

TEST(DistanceField, is_exact_at_every_grid_point_of_a_box) {
  expect_exact(box({-20, -20, -20}, {20, 20, 20}));
  expect_exact(box({-20.3, -17.1, 0}, {13.9, 11.7, 23.123}));
}

TEST(DistanceField, is_exact_where_grid_lines_pass_through_vertices_and_edges) {
  Surface octahedron{"octahedron", {}, {}};
  for (int a = 0; a < 3; ++a)
    for (const double side : {-24.0, 24.0}) octahedron.points.push_back(side * Vec3::Unit(a));
  for (const int64_t x : {0, 1})
    for (const int64_t y : {2, 3})
      for (const int64_t z : {4, 5})
        octahedron.triangles.push_back((x + y + z) % 2 == 0 ? Triangle{x, z, y}
                                                            : Triangle{x, y, z});
  expect_exact(octahedron);
}

TEST(DistanceField, is_exact_at_every_grid_point_of_a_thin_plate) {
  const Surface plate = box({-30, -25, 0}, {30, 25, 0.8});
  const DistanceTree tree(plate);
  for (const double spacing : {0.6, 0.7, 0.75}) expect_exact(plate, tree, spacing, 1);
  for (const double spacing : spacings) {
    Surface tilted = plate;
    for (Vec3& p : tilted.points) p.z() += 0.3 * p.x() + 0.2 * p.y();
    expect_exact(tilted, DistanceTree(tilted), spacing, 1);
  }
}

TEST(DistanceField, is_exact_around_a_bone_with_saw_cuts_perpendicular_to_the_grid) {
  const Surface jaw = weld_and_orient(mandible());
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : jaw.points) middle += p / static_cast<double>(jaw.points.size());
  for (int axis = 0; axis < 3; ++axis)
    expect_exact(meshtools::cut_bone(jaw, {"cut", {{middle, Vec3::Unit(axis)}}, {}, 0, {}}).piece,
                 17);
}

class RealBone : public ::testing::TestWithParam<const char*> {};

TEST_P(RealBone, is_exact_at_one_grid_point_in_127) {
  const std::filesystem::path file = std::filesystem::path(REPOSE_HEAD_DATA) / GetParam();
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "the real head is not here (" << file << "): not tested";
  expect_exact(load_surface(file, Role::bone), 127);
}

INSTANTIATE_TEST_SUITE_P(DistanceField, RealBone, ::testing::Values("skull.ply", "mandible.ply"));

TEST(DistanceField, is_negative_wherever_the_winding_number_is_not_0) {
  const Surface large = box({-20, -20, -20}, {20, 20, 20});
  Surface inverted = large, cavity = box({-12, -12, -12}, {12, 12, 12});
  for (Triangle& t : inverted.triangles) turn(t);
  for (Triangle& t : cavity.triangles) turn(t);
  const Surface overlapping = both(large, box({5, -10, -10}, {30, 10, 10})),
                hollow = both(large, cavity);
  for (const double spacing : spacings) {
    EXPECT_LT(DistanceField(inverted, spacing, reach).value({14, 3, 2}), 0);
    EXPECT_EQ(DistanceField(inverted, spacing, reach).value({40, 3, 2}), reach);
    EXPECT_LT(DistanceField(overlapping, spacing, reach).value({13, 1, 2}), 0);
    EXPECT_LT(DistanceField(overlapping, spacing, reach).value({25, 1, 2}), 0);
    EXPECT_LT(DistanceField(hollow, spacing, reach).value({16, 1, 2}), 0);
    EXPECT_GT(DistanceField(hollow, spacing, reach).value({1, 2, 3}), 0);
  }
}

TEST(DistanceField, values_depend_neither_on_order_nor_on_copies) {
  const Surface jaw = mandible();
  const DistanceField one(jaw, 1.7, reach), copy = one, other(jaw, 1.7, reach);
  std::vector<DistanceField::Index> order;
  const auto [nx, ny, nz] = one.grid_points();
  for (int64_t n = 0; n < nx * ny * nz; n += 97)
    order.push_back({n % nx, n / nx % ny, n / nx / ny});
  std::vector<float> values;
  for (const auto& at : order) values.push_back(one.value_at(at));
  std::vector<size_t> shuffled(order.size());
  for (size_t n = 0; n < order.size(); ++n) shuffled[n] = n;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(3));
  for (const size_t n : shuffled) {
    ASSERT_EQ(other.value_at(order[n]), values[n]);
    ASSERT_EQ(copy.value_at(order[n]), values[n]);
  }
}

TEST(DistanceField, computes_only_values_that_are_needed) {
  const DistanceField field(box({-20, -20, -20}, {20, 20, 20}), 1.0, reach);
  EXPECT_EQ(field.computed_values(), 0);
  EXPECT_EQ(field.value({0, 0, 300}), reach);
  EXPECT_EQ(field.computed_values(), 0);
  EXPECT_LT(field.value({0.5, 0.5, 19.5}), 0);
  EXPECT_EQ(field.computed_values(), 64 + 6 * 16);  // with the neighbors
  EXPECT_LT(field.value({0.6, 0.4, 19.3}), 0);
  EXPECT_EQ(field.computed_values(), 64 + 6 * 16);
}

TEST(DistanceField, lower_bounds_hold_and_are_close_where_closeness_is_requested) {
  const Surface jaw = mandible();
  const DistanceTree tree(jaw);
  const DistanceField sharp(jaw, 0.8, reach), rounded = sharp.rounded(2.5);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-3, 3);
  double largest_excess = 0, largest_shortfall = 0;
  for (size_t n = 0; n < jaw.points.size(); n += 3) {
    const Vec3 point = jaw.points[n] + Vec3(off(random), off(random), off(random));
    for (const DistanceField* field : {&sharp, &rounded})
      for (const double enough : {0.0, 0.5, 2.0, 20.0}) {
        const double value = field->value(point), bound = field->lower_bound(point, enough);
        largest_excess = std::max(largest_excess, bound - value);
        if (enough < 20 || tree.contains(point)) continue;
        const double exact = std::min(tree.nearest(point).distance, reach);
        largest_shortfall = std::max(largest_shortfall, exact - bound);
      }
  }
  EXPECT_LE(largest_excess, 1e-5);
  EXPECT_LT(largest_shortfall, (3 * 0.87 + 0.97) * 2);  // where the grid point is inside
}

TEST(DistanceField, distances_outside_are_exact) {
  const Surface jaw = mandible();
  const DistanceTree tree(jaw);
  const DistanceField field(jaw, 0.8, reach);
  int compared = 0;
  for (const Vec3& at : jaw.points) {
    const Vec3 point = at + Vec3(2, -1, 1.5);
    const DistanceTree::Nearest nearest = tree.nearest(point);
    if (tree.contains(point) || nearest.distance >= reach) continue;
    const Distance d = field.outside(point);
    ASSERT_NEAR(d.value, nearest.distance, 1e-9);
    ASSERT_LT((d.gradient - (point - nearest.point) / nearest.distance).norm(), 1e-6);
    ++compared;
  }
  EXPECT_GT(compared, 100);
}

TEST(DistanceField, refuses_a_grid_that_is_too_fine) {
  const std::string message = refusal([] {
    DistanceField(box({-20, -20, -20}, {20, 20, 20}), 1e-3, reach);
  });
  EXPECT_NE(message.find("box: "), std::string::npos) << message;
  EXPECT_NE(message.find("contact.grid"), std::string::npos) << message;
}

TEST(DistanceField, is_exact_beside_a_plane_part) {
  const DistanceField field(box({-20, -20, -20}, {20, 20, 20}), 1.0, 6.0);
  for (const double z : {-5.3, -1.0, 0.0, 0.7, 3.1}) {
    const Distance d = field.sample({3.2, -4.7, 20 + z});
    EXPECT_NEAR(d.value, z, 1e-5);
    EXPECT_LT((d.gradient - Vec3::UnitZ()).norm(), 1e-5);
    EXPECT_LT(d.curvature.norm(), 1e-5);
  }
}

TEST(DistanceField, rounds_a_convex_edge_by_a_fifth_of_a_spacing_and_nothing_else_much) {
  const DistanceField field(box({-20, -20, -20}, {20, 20, 20}), 1.0, 6.0),
      rounded = field.rounded(1);
  const double at_edge = field.value({20, 20, 0.3}), rounded_edge = rounded.value({20, 20, 0.3});
  EXPECT_GT(at_edge, 0.1);
  EXPECT_LT(at_edge, 0.23);
  EXPECT_GT(rounded_edge, 0.28);
  EXPECT_LT(rounded_edge, 0.37);
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
      const DistanceField field(s, 1.0, 6.0);
      for (double beyond = 0.5; beyond < 12; beyond += 0.5) {
        EXPECT_GT(field.value({0, -20 - beyond, 20 + beyond}), 0) << y << " " << z << " " << beyond;
        EXPECT_LT(field.value({0, -20 + beyond, 20 - beyond}), 0) << y << " " << z << " " << beyond;
      }
    }
}

TEST(DistanceField, derivatives_are_those_of_its_value) {
  const DistanceField field(box({-9, -7, -8}, {9, 7, 8}), 0.8, 5.0);
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
  const Surface jaw = mandible();
  const DistanceField field(jaw, 1.0, 6.0);
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
  EXPECT_LT(worst, 0.4);
  EXPECT_LT(sum / count, 0.03);
}

}  // namespace distance_field_test
}  // namespace repose::surface
