#include "repose/imaging/isosurface.h"

#include <Eigen/Geometry>
#include <random>

#include "../surface/shapes.h"
#include "repose/imaging/extract.h"
#include "repose/imaging/taubin.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "volumes.h"

namespace repose::imaging {
using namespace surface;
namespace isosurface_test {

constexpr double pi = M_PI;

/// Turned, stretched by spacing, and sheared as a tilted gantry does.
Mat3 oblique_axes() {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  Mat3 axes = turn * Vec3(0.8, 1.1, 1.5).asDiagonal();
  axes.col(2) += 0.3 * axes.col(1);
  return axes;
}

Volume noise(int64_t n, unsigned seed, int values) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> whole(0, values - 1);
  return sampled(n, Mat3::Identity(), [&](const Vec3&) { return whole(random); });
}

/// No defect but, where allowed, a border; the reason in words otherwise.
std::string fault(const Surface& surface, bool may_be_open) {
  const Defects d = inspect(surface, true);
  const bool sound = d.non_manifold_edges == 0 && d.non_manifold_vertices == 0 &&
                     d.misoriented_edges == 0 && d.duplicate_vertices == 0 &&
                     d.isolated_vertices == 0 && d.degenerate_triangles == 0 &&
                     d.self_intersections == 0 && (may_be_open || d.outward);
  return sound ? "" : describe(d);
}

TEST(Isosurface, sphere_on_an_oblique_grid_has_its_area_and_volume) {
  const double radius = 17;
  const Volume volume = sampled(50, oblique_axes(), [&](const Vec3& p) { return 9 - p.norm(); });
  const Surface ball = isosurface(volume, 9 - radius);
  EXPECT_EQ(fault(ball, false), "");
  EXPECT_EQ(euler_characteristic(ball), 2);
  EXPECT_NEAR(area_of(ball), 4 * pi * radius * radius, 0.005 * 4 * pi * radius * radius);
  EXPECT_NEAR(volume_of(ball), 4.0 / 3 * pi * std::pow(radius, 3),
              0.005 * 4.19 * std::pow(radius, 3));
  double maximum = 0;
  for (const Vec3& p : ball.points) maximum = std::max(maximum, std::abs(p.norm() - radius));
  EXPECT_LT(maximum, 0.03) << "mm; linear interpolation of a distance";
}

TEST(Isosurface, torus_has_one_handle) {
  const double large = 12, small = 5;
  const Volume volume = sampled(41, Mat3::Identity(), [&](const Vec3& p) {
    return small - std::hypot(std::hypot(p.x(), p.y()) - large, p.z());
  });
  const Surface torus = isosurface(volume, 0);
  EXPECT_EQ(fault(torus, false), "");
  EXPECT_EQ(euler_characteristic(torus), 0);
  const double area = 4 * pi * pi * large * small, inside = 2 * pi * pi * large * small * small;
  EXPECT_NEAR(area_of(torus), area, 0.01 * area);
  EXPECT_NEAR(volume_of(torus), inside, 0.01 * inside);
}

TEST(Isosurface, a_mirrored_grid_still_faces_outward) {
  const Mat3 mirrored = Vec3(-1, 1, 1).asDiagonal();
  const Surface ball =
      isosurface(sampled(21, mirrored, [](const Vec3& p) { return -p.norm(); }), -7);
  EXPECT_EQ(fault(ball, false), "");
}

// Every one of the 256 cases and every pair of neighbors occurs in noise; few values make many
// voxels lie exactly on the level.
TEST(Isosurface, noise_gives_closed_manifolds) {
  for (unsigned seed = 0; seed < 60; ++seed)
    for (const int values : {2, 3, 1000}) {
      const Surface surface = isosurface(noise(9, seed, values), values / 2);
      ASSERT_EQ(fault(surface, false), "") << "seed " << seed << ", values " << values;
    }
}

TEST(Isosurface, noise_with_an_open_border_is_a_manifold_whose_rim_is_there) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    const Volume volume = noise(8, seed, 3);
    const Surface surface = isosurface(volume, 1, VolumeBorder::open);
    ASSERT_EQ(fault(surface, true), "") << "seed " << seed;
    ASSERT_GT(inspect(surface, false).border_edges, 0);
    for (const Vec3& p : surface.points) ASSERT_LE(p.lpNorm<Eigen::Infinity>(), 3.5);
  }
}

TEST(Isosurface, caps_lie_in_the_outermost_voxel_centers) {
  const Surface block = isosurface(
      sampled(11, Mat3::Identity(), [](const Vec3& p) { return p.x() > -4 ? 1.0 : 0.0; }), 0.5);
  EXPECT_EQ(fault(block, false), "");
  EXPECT_NEAR(volume_of(block), 8.5 * 10 * 10, 0.01 * 850);
}

TEST(Isosurface, diagonal_neighbors_are_parted) {
  Volume volume = sampled(6, Mat3::Identity(), [](const Vec3&) { return 0; });
  volume.values[volume.index(2, 2, 2)] = volume.values[volume.index(3, 3, 2)] = 1;
  volume.values[volume.index(4, 4, 3)] = 1;
  EXPECT_EQ(components(isosurface(volume, 0.5)).size(), 3u);
}

TEST(Isosurface, a_level_outside_the_data_is_refused) {
  const Volume volume = noise(4, 1, 10);
  for (const double level : {-1.0, 0.0, 9.5, std::nan("")})
    EXPECT_NE(refusal([&] { isosurface(volume, level); }).find("its values go from 0 to 9"),
              std::string::npos);
}

TEST(Components, largest_and_above_a_volume) {
  const Volume volume = sampled(40, Mat3::Identity(), [](const Vec3& p) {
    const double big = 9 - (p - Vec3(-8, 0, 0)).norm(), hollow = (p - Vec3(-8, 0, 0)).norm() - 4;
    return std::max(std::min(big, hollow), 5 - (p - Vec3(10, 0, 0)).norm());
  });
  const Surface all = isosurface(volume, 0);
  const auto parts = components(all);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_NEAR(volume_of(parts[0]), 4.19 * 729, 30);
  EXPECT_NEAR(volume_of(parts[1]), 4.19 * 125, 15);
  EXPECT_NEAR(volume_of(parts[2]), -4.19 * 64, 10) << "the wall of the cavity";
  EXPECT_EQ(largest_component(all).triangles.size(), parts[0].triangles.size());
  EXPECT_EQ(components_above(all, 400).triangles.size(),
            parts[0].triangles.size() + parts[1].triangles.size());
  EXPECT_NE(refusal([&] { components_above(all, 5000); }).find("the largest has 30"),
            std::string::npos);
}

TEST(Taubin, smooths_a_label_without_shrinking_it) {
  const Volume labels =
      sampled(41, Mat3::Identity(), [](const Vec3& p) { return p.norm() < 15 ? 1.0 : 0.0; });
  const Surface steps = isosurface(labels, 0.5);
  Surface smooth = steps;
  const double moved = smooth_taubin(smooth, 20);
  EXPECT_GT(moved, 0.1);
  EXPECT_LT(moved, 1);
  EXPECT_NEAR(volume_of(smooth), volume_of(steps), 0.005 * volume_of(steps));
  EXPECT_LT(area_of(smooth), 0.95 * area_of(steps)) << "steps are gone";
  EXPECT_NEAR(area_of(smooth), 4 * pi * 225, 0.03 * 4 * pi * 225);
  EXPECT_EQ(fault(smooth, false), "");
}

TEST(Taubin, a_rim_stays) {
  Surface sheet = patch(6);
  for (Vec3& p : sheet.points) p.z() = 3 * std::sin(p.x()) * std::cos(7 * p.y());
  const Surface before = sheet;
  smooth_taubin(sheet, 5);
  for (size_t i = 0; i < sheet.points.size(); ++i) {
    const Vec3& p = before.points[i];
    const bool rim = p.x() == 0 || p.x() == 60 || p.y() == 0 || p.y() == 60;
    EXPECT_EQ(sheet.points[i] == p, rim) << p.transpose();
  }
}

TEST(Extract, says_what_it_did) {
  const Volume volume = sampled(40, Mat3::Identity(), [](const Vec3& p) { return -p.norm(); });
  Extraction requested;
  requested.level = -12;
  requested.box = {{Vec3(-30, -30, -30), Vec3(30, 0.4, 30)}};
  requested.voxel = 2;
  requested.largest = true;
  requested.smooth = 3;
  const Extracted half = extract(volume, requested);
  EXPECT_EQ(fault(half.surface, false), "");
  EXPECT_NEAR(volume_of(half.surface), 2.0 / 3 * pi * 1728, 0.06 * 3619);
  ASSERT_EQ(half.remarks.size(), 4u);
  EXPECT_EQ(half.remarks[0], "cropped to 40 × 21 × 40 voxels of 1 × 1 × 1 mm");
  EXPECT_EQ(half.remarks[1], "averaged to 20 × 11 × 20 voxels of 2 × 1.91 × 2 mm");
  requested.otsu = true;
  EXPECT_NE(refusal([&] { extract(volume, requested); }).find("in one way"), std::string::npos);
}

}  // namespace isosurface_test
}  // namespace repose::imaging
