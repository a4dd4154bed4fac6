#include "repose/meshtools/face.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "../imaging/volumes.h"
#include "../surface/shapes.h"
#include "imaging/distance_volume.h"
#include "repose/imaging/isosurface.h"
#include "repose/imaging/outer_skin.h"
#include "repose/meshtools/signed_distance.h"
#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/triangle_tree.h"

namespace repose::meshtools {
using namespace surface;
using namespace imaging;
namespace face_test {

constexpr double radius = 45;  // mm

/// Returns the inside of a field of this sign, from voxels of 2 mm in a cube of 120 mm.
Surface solid(const std::function<double(const Vec3&)>& inside) {
  return isosurface(sampled(61, 2 * Mat3::Identity(), inside), 0);
}

double ball(const Vec3& x) { return radius - x.norm(); }

/// A ball with a cavity, a thin fin to +x, 2 % of its triangles gone and a tenth turned round.
Surface dirty_ball() {
  Surface surface = solid([](const Vec3& x) {
    const double fin = std::min(3 - std::abs(x.y()), 56 - x.head<2>().norm() - 2 * std::abs(x.z()));
    return std::min(x.x() > 0 ? std::max(ball(x), fin) : ball(x), x.norm() - 20);
  });
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> share(0, 1);
  std::erase_if(surface.triangles, [&](const Triangle&) { return share(generator) < 0.02; });
  for (Triangle& triangle : surface.triangles)
    if (share(generator) < 0.1) turn(triangle);
  return surface;
}

double angle_from(const Vec3& axis, const Vec3& x) {
  return std::acos(axis.dot(x) / (axis.norm() * x.norm()));
}

TEST(DistanceVolume, is_the_distance_to_the_nearest_triangle) {
  const Surface surface = cube(Vec3::Zero(), 20);
  const DistanceTree tree(surface);
  const double reach = 9;
  const Volume volume = distance_volume(surface, 1.5, 12, reach);
  for (int64_t k = 0; k < volume.size[2]; k += 3)
    for (int64_t j = 0; j < volume.size[1]; j += 3)
      for (int64_t i = 0; i < volume.size[0]; ++i) {
        const Vec3 at = volume.origin + 1.5 * Vec3(i, j, k);
        EXPECT_NEAR(volume.at(i, j, k), std::min(tree.nearest(at).distance, reach), 0.1);
      }
  EXPECT_LE(volume.origin.maxCoeff(), -12);
}

TEST(TreeOfPoints, finds_the_nearest_point) {
  std::vector<Vec3> points;
  for (int i = 0; i < 50; ++i) points.push_back(Vec3(i * i, 0, 0));
  EXPECT_EQ(tree_of_points(points).nearest(Vec3(10, 1, 0)).triangle, 3);
  EXPECT_EQ(tree_of_points({Vec3::Zero()}).nearest(Vec3::Ones()).triangle, 0);
}

TEST(OuterSkin, has_no_inner_wall_no_hole_and_no_thin_sheet) {
  const OuterSkin outer = outer_skin(dirty_ball(), {});
  const Defects defects = inspect(outer.skin);
  EXPECT_EQ(defects.components, 1);
  EXPECT_EQ(defects.border_edges + defects.non_manifold_edges + defects.non_manifold_vertices, 0);
  EXPECT_TRUE(defects.outward);
  EXPECT_TRUE(outer.caps.triangles.empty());
  for (const Vec3& x : outer.skin.points) {
    EXPECT_GT(x.norm(), radius - 0.5);
    EXPECT_LT(x.norm(), angle_from(Vec3::UnitX(), x) < 0.6 ? radius + 3 : radius + 0.5);
  }
}

TEST(OuterSkin, knows_where_the_scan_ends) {
  const auto cut = [](const Vec3& x) { return std::min(ball(x), x.z() + 10); };
  const OuterSkin flat = outer_skin(solid(cut), {});
  ASSERT_FALSE(flat.caps.triangles.empty());
  for (const Triangle& t : flat.caps.triangles)
    EXPECT_NEAR(flat.caps.points[t[0]].z(), -10 - outside_ball, 1);
  Surface open = solid(ball);  // its rim is closed by a cone
  std::erase_if(open.triangles, [&](const Triangle& t) { return open.points[t[0]].z() < -10; });
  const OuterSkin closed = outer_skin(open, {});
  ASSERT_FALSE(closed.caps.triangles.empty());
  for (const Triangle& t : closed.caps.triangles) EXPECT_LT(closed.caps.points[t[0]].z(), -5);
  for (const Vec3& x : closed.skin.points) EXPECT_GT(x.z(), -14);
}

TEST(OuterSkin, refuses_what_is_no_solid) {
  Surface sheets = cube(Vec3::Zero(), 60);
  for (Vec3& x : sheets.points) x.z() /= 10;
  EXPECT_NE(refusal([&] { outer_skin(sheets, {}); }).find("tissue.edge"), std::string::npos);
}

TEST(SolvableFace, keeps_an_open_mouth_open_and_closes_a_hole) {
  for (const double opening : {12.0, 4.0}) {  // mm, radius
    Surface given = solid(ball);
    std::erase_if(given.triangles, [&](const Triangle& t) {
      const Vec3& x = given.points[t[0]];
      return x.y() < 0 && std::hypot(x.x(), x.z()) < opening;
    });
    FaceRequest request{4};
    request.places = {Vec3(0, -radius, 0)};
    const Face face = solvable_face(given, request);
    const bool mouth = opening > 10;
    EXPECT_EQ(inspect(face.skin, false).border_loops, mouth ? 2 : 1);
    EXPECT_EQ(face.borders, mouth ? 2 : 1);
    EXPECT_EQ(face.openings, mouth ? 1 : 0);
    double nearest = radius;  // mm, of its points to the middle of the opening
    for (const Vec3& x : face.skin.points) nearest = std::min(nearest, std::hypot(x.x(), x.z()));
    EXPECT_NEAR(nearest, mouth ? opening : 0, 3);
  }
}

TEST(SolvableFace, lies_on_the_given_skin_and_is_well_shaped) {
  for (const double noise : {0.0, 0.5}) {
    Surface given = dirty_ball();
    std::mt19937 generator(5);
    std::normal_distribution<double> number(0, noise > 0 ? noise : 1);
    for (Vec3& x : given.points)
      if (noise > 0) x += Vec3(number(generator), number(generator), number(generator));
    FaceRequest request{4};
    request.places = {Vec3(0, -radius, 0)};
    const Face face = solvable_face(given, request);
    EXPECT_GT(face.min_angle, 20);
    EXPECT_LT(face.off_95, 0.2 + noise);
    const Defects defects = inspect(face.skin);
    EXPECT_EQ(defects.components, 1);
    EXPECT_EQ(defects.border_loops, 1);
    EXPECT_EQ(defects.self_intersections, 0);
    double farthest = 0;
    for (const Vec3& x : face.skin.points) {
      EXPECT_NEAR(x.norm(), radius, 0.25 + noise);
      farthest = std::max(farthest, radius * angle_from(request.places[0], x));
    }
    EXPECT_NEAR(farthest, face_near + request.margin, 6);  // 25 mm straight, 35 mm along
  }
}

TEST(SolvableFace, keeps_off_the_end_of_a_scan_and_takes_all_where_nothing_is_named) {
  const Surface given = solid([](const Vec3& x) { return std::min(ball(x), x.z() + 10); });
  const Face face = solvable_face(given, {4});
  for (const Vec3& x : face.skin.points) EXPECT_GT(x.z(), -9.5);
  EXPECT_EQ(inspect(face.skin).border_loops, 1);
  EXPECT_EQ(inspect(solvable_face(solid(ball), {4}).skin).border_edges, 0);
}

TEST(SolvableFace, is_the_skin_in_the_regions_where_there_are_any) {
  FaceRequest request{4};
  request.places = {Vec3(0, 0, -radius)};
  request.regions = {[](const Vec3& x) { return x.z() > 20; },
                     [](const Vec3& x) { return x.z() > -10 && x.x() > 0; }};
  const Face face = solvable_face(solid(ball), request);
  double left = radius, right = radius;
  for (const Vec3& x : face.skin.points) {
    if (x.x() < -15) left = std::min(left, x.z());
    if (x.x() > 15) right = std::min(right, x.z());
  }
  EXPECT_NEAR(left, 20, 3);
  EXPECT_NEAR(right, -10, 3);
  request.regions = {[](const Vec3& x) { return x.z() > 100; }};
  EXPECT_NE(refusal([&] { solvable_face(solid(ball), request); }).find("tissue.face"),
            std::string::npos);
}

TEST(SolvableFace, refuses_bones_that_are_elsewhere) {
  FaceRequest request{4};
  request.beneath = {cube(Vec3(200, 0, 0), 20)};
  EXPECT_NE(refusal([&] { solvable_face(solid(ball), request); }).find("frame"), std::string::npos);
}

}  // namespace face_test
}  // namespace repose::meshtools
