#include "repose/tools/comparison/compare.h"

#include <Eigen/Geometry>
#include <random>

#include "../imaging/volumes.h"
#include "../surface/shapes.h"
#include "repose/imaging/isosurface.h"

namespace repose::tools::comparison {
using namespace surface;
using namespace imaging;
namespace compare_test {

Surface ball(double radius) {
  return isosurface(sampled(40, Mat3::Identity(), [](const Vec3& p) { return -p.norm(); }),
                    -radius);
}

TEST(Compare, spheres_lie_apart_by_the_difference_of_their_radii) {
  const Surface small = ball(12), large = ball(15);
  const auto s = statistics(sample_distances(small, SignedDistance(large), 1));
  EXPECT_NEAR(s.mean_signed, -3, 0.03);
  EXPECT_NEAR(s.mean, 3, 0.03);
  EXPECT_NEAR(s.rms, 3, 0.03);
  EXPECT_NEAR(s.percentile_90, 3, 0.05);
  EXPECT_NEAR(s.percentile_95, 3, 0.05);
  EXPECT_NEAR(s.maximum, 3, 0.1);
  EXPECT_NEAR(s.area, 4 * M_PI * 144, 20);
  const auto back = statistics(sample_distances(large, SignedDistance(small), 1));
  EXPECT_NEAR(back.mean_signed, 3, 0.03);
}

TEST(Compare, the_sign_is_right_at_edges_and_corners) {
  const Surface box = cube();
  const SignedDistance distance(box);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-60, 160);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 point(anywhere(random), anywhere(random), anywhere(random));
    const bool inside = (point.array() > 0).all() && (point.array() < 100).all();
    const Vec3 nearest = point.cwiseMax(0).cwiseMin(100);
    const double outside = (point - nearest).norm();
    const double depth = std::min(point.minCoeff(), (100 - point.array()).minCoeff());
    EXPECT_NEAR(distance.at(point).distance, inside ? -depth : outside, 1e-9) << point.transpose();
  }
}

// A surface of noise has edges and corners of every kind, saddles too; the parity of a ray tells
// the truth.
TEST(Compare, the_sign_is_right_on_a_surface_of_noise) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(0, 1), place(-4, 4);
  const Surface rough =
      isosurface(sampled(8, Mat3::Identity(), [&](const Vec3&) { return value(random); }), 0.6);
  const SignedDistance distance(rough);
  const DistanceTree tree(rough);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 point(place(random), place(random), place(random));
    ASSERT_EQ(distance.at(point).distance < 0, tree.contains(point)) << point.transpose();
  }
}

TEST(Compare, statistics_do_not_depend_on_the_meshing) {
  const Surface sheet = patch(), box = cube({-500, -500, -1000}, 1000);  // the sheet lies on top
  Surface tilted = sheet;
  for (Vec3& p : tilted.points) p.z() = p.x() / 10;  // 0 … 4 mm
  const auto fine = statistics(sample_distances(tilted, SignedDistance(box), 0.5));
  const auto coarse = statistics(sample_distances(tilted, SignedDistance(box), 5));
  EXPECT_NEAR(fine.mean_signed, 2, 1e-6);
  EXPECT_NEAR(coarse.mean_signed, 2, 1e-6);
  EXPECT_NEAR(fine.rms, 4 / std::sqrt(3), 0.01);
  EXPECT_NEAR(fine.percentile_90, 3.6, 0.05);
  EXPECT_NEAR(fine.percentile_95, 3.8, 0.05);
  EXPECT_GT(fine.samples, 50 * coarse.samples);
}

TEST(Compare, what_lies_beyond_the_rim_is_known) {
  const Surface sheet = patch();  // 40 × 40 mm
  const SignedDistance distance(sheet);
  EXPECT_FALSE(distance.at({20, 20, 3}).beyond_rim);
  EXPECT_FALSE(distance.at({10, 20, -3}).beyond_rim) << "on an inner edge";
  EXPECT_EQ(distance.at({10, 20, -3}).distance, -3);
  EXPECT_TRUE(distance.at({45, 20, 3}).beyond_rim);
  EXPECT_TRUE(distance.at({-4, -3, 0}).beyond_rim);
  EXPECT_NEAR(std::abs(distance.at({-4, -3, 0}).distance), 5, 1e-12);
}

TEST(Compare, colors_go_from_blue_over_white_to_red) {
  EXPECT_EQ(distance_color(0, 2), (std::array<uint8_t, 3>{255, 255, 255}));
  EXPECT_EQ(distance_color(-9, 2), distance_color(-2, 2));
  EXPECT_GT(distance_color(-2, 2)[2], distance_color(-2, 2)[0]);
  EXPECT_GT(distance_color(2, 2)[0], distance_color(2, 2)[2]);
}

}  // namespace compare_test
}  // namespace repose::tools::comparison
