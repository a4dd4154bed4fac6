#include "repose/tools/phantom/phantom.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "../../folder.h"
#include "../surface/shapes.h"
#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/read.h"
#include "tools/phantom/phantom_shape.h"
#include "tools/phantom/phantom_solid.h"

namespace repose::tools::phantom {
using namespace surface;
namespace phantom_test {

int64_t edge_count(const Surface& surface) {
  std::vector<std::pair<int64_t, int64_t>> edges;
  for (const auto& t : surface.triangles)
    for (int i = 0; i < 3; ++i) edges.push_back(std::minmax(t[i], t[(i + 1) % 3]));
  std::sort(edges.begin(), edges.end());
  return std::unique(edges.begin(), edges.end()) - edges.begin();
}

/// The smallest angle of every triangle, degrees, sorted.
std::vector<double> smallest_angles(const Surface& surface) {
  std::vector<double> result;
  for (const auto& t : surface.triangles) {
    double minimum = 180;
    for (int i = 0; i < 3; ++i) {
      const Vec3 a = surface.points[t[(i + 1) % 3]] - surface.points[t[i]];
      const Vec3 b = surface.points[t[(i + 2) % 3]] - surface.points[t[i]];
      minimum = std::min(minimum, std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi);
    }
    result.push_back(minimum);
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// Vertices, middles of edges and of triangles.
std::vector<Vec3> samples(const Surface& surface) {
  std::vector<Vec3> result = surface.points;
  for (const auto& t : surface.triangles) {
    const Vec3 &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
    for (const Vec3& middle : {Vec3((a + b) / 2), Vec3((b + c) / 2), Vec3((c + a) / 2)})
      result.push_back(middle);
    result.push_back((a + b + c) / 3);
  }
  return result;
}

/// Least and greatest distance from one surface's samples to the other surface.
std::pair<double, double> distances(const Surface& from, const Surface& to) {
  const DistanceTree tree(to);
  double minimum = 1e300, greatest = 0;
  for (const Vec3& point : samples(from)) {
    const double d = tree.nearest(point).distance;
    minimum = std::min(minimum, d);
    greatest = std::max(greatest, d);
  }
  return {minimum, greatest};
}

double gap(const Surface& a, const Surface& b) {
  return std::min(distances(a, b).first, distances(b, a).first);
}

Surface opened(Surface mandible, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  for (Vec3& p : mandible.points) p = Eigen::AngleAxisd(angle, Vec3::UnitX()) * p;
  return mandible;
}

const Phantom& paper_head() {
  static const Phantom head = make_phantom({.skin_vertices = 477});
  return head;
}

const Phantom& default_head() {
  static const Phantom head = make_phantom({});
  return head;
}

class Skin : public ::testing::TestWithParam<int64_t> {};

TEST_P(Skin, is_an_annulus_of_good_triangles_that_look_outwards) {
  const int64_t n = GetParam();
  const Surface skin = make_phantom_skin(n);
  const auto vertices = static_cast<int64_t>(skin.points.size());
  const auto triangles = static_cast<int64_t>(skin.triangles.size());
  EXPECT_EQ(vertices, n);
  EXPECT_EQ(vertices - edge_count(skin) + triangles, 0);
  const Defects defects = inspect(skin);
  EXPECT_EQ(defects.border_loops, 2);
  EXPECT_EQ(defects.border_edges, 2 * vertices - triangles);
  EXPECT_EQ(defects.components, 1);
  EXPECT_EQ(defects.self_intersections, 0);
  EXPECT_EQ(defects.misoriented_edges + defects.non_manifold_edges + defects.non_manifold_vertices +
                defects.degenerate_triangles + defects.duplicate_vertices +
                defects.isolated_vertices,
            0);
  const std::vector<double> angles = smallest_angles(skin);
  EXPECT_GT(angles.front(), 15);
  EXPECT_GT(angles[angles.size() / 100], 30);
  for (const auto& t : skin.triangles) {
    const Vec3 &a = skin.points[t[0]], &b = skin.points[t[1]], &c = skin.points[t[2]];
    const Vec3 outwards = (a + b + c) / 3 - Vec3(0, 10, 34);
    EXPECT_GT((b - a).cross(c - a).normalized().dot(outwards.normalized()), 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(Phantom, Skin, ::testing::Values(477, 478, 1234, 2000, 20000));

TEST(Phantom, of_the_papers_size_has_the_papers_counts) {
  const Surface& skin = paper_head().skin;
  EXPECT_EQ(skin.points.size(), 477u);
  EXPECT_EQ(edge_count(skin), 1351);
  EXPECT_EQ(skin.triangles.size(), 874u);
  EXPECT_EQ(inspect(skin, false).border_edges, 80);
}

TEST(Phantom, skin_lies_on_the_shape_and_has_the_size_of_a_face) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (const Vec3& point : default_head().skin.points) {
    EXPECT_NEAR(skin_distance(point), 0, 1e-9);
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  EXPECT_NEAR(high.x() - low.x(), 150, 5);
  EXPECT_NEAR(high.z() - low.z(), 175, 20);
}

TEST(Phantom, has_tissue_of_a_living_faces_thickness_over_its_bones) {
  for (const Phantom* head : {&paper_head(), &default_head()}) {
    EXPECT_GT(gap(head->skin, head->skull), 3);
    EXPECT_GT(gap(head->skin, head->mandible), 3);
    const DistanceTree skull(head->skull), mandible(head->mandible);
    for (const Vec3& point : head->skin.points)
      EXPECT_LT(std::min(skull.nearest(point).distance, mandible.nearest(point).distance), 25);
  }
}

TEST(Phantom, bones_are_closed_solid_and_apart) {
  for (const Phantom* head : {&paper_head(), &default_head()}) {
    for (const Surface* bone : {&head->skull, &head->mandible}) {
      const Defects defects = inspect(*bone);
      EXPECT_TRUE(defects.outward);
      EXPECT_EQ(defects.border_edges, 0);
      EXPECT_EQ(defects.components, 1);
      EXPECT_EQ(defects.self_intersections, 0);
      EXPECT_EQ(describe(defects), "closed, 1 component, no defect");
    }
    EXPECT_GT(gap(head->skull, head->mandible), 1);
  }
}

TEST(Phantom, bones_get_finer_on_demand) {
  const Surface coarse = make_phantom_mandible(5), fine = make_phantom_mandible(2.5);
  EXPECT_GT(fine.points.size(), 2 * coarse.points.size());
  EXPECT_LT(distances(coarse, fine).second, 1);
}

TEST(Phantom, jaw_opens_about_the_hinge_axis_without_touching_the_skull) {
  const Phantom& head = default_head();
  const Surface open = opened(head.mandible, 8);
  EXPECT_GT(gap(head.skull, open), 0.5);
  const auto chin = std::min_element(head.mandible.points.begin(), head.mandible.points.end(),
                                     [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  const Vec3& moved = open.points[chin - head.mandible.points.begin()];
  EXPECT_LT(moved.z(), chin->z() - 5);
  EXPECT_GT(moved.y(), chin->y() + 5);
}

TEST(Phantom, landmarks_lie_where_their_names_say) {
  std::map<std::string, Vec3> at = default_head().landmarks;
  EXPECT_LT(at["pronasale"].y(), at["upper_lip"].y());
  EXPECT_GT(at["upper_incisor_edge"].z(), at["lower_incisor_edge"].z() + 1);
  EXPECT_NEAR(skin_distance(at["pogonion_soft"]), 0, 1e-6);
  EXPECT_NEAR(mandible_distance(at["pogonion_bone"]), 0, 1e-6);
  EXPECT_NEAR(skull_distance(at["nasion_bone"]), 0, 1e-6);
  EXPECT_NEAR((at["gonion_left"] - at["gonion_right"]).x(), 88, 5);
}

TEST(Phantom, refuses_sizes_out_of_range) {
  EXPECT_NE(refusal([] { make_phantom_skin(476); }).find("477"), std::string::npos);
  EXPECT_NE(refusal([] { make_phantom_skin(2'000'001); }).find("2000000"), std::string::npos);
  EXPECT_NE(refusal([] { make_phantom_mandible(0.1); }).find("0.5"), std::string::npos);
  EXPECT_NE(refusal([] { make_phantom_mandible(std::nan("")); }).find("nan"), std::string::npos);
}

TEST(Phantom, shipped_paper_head_is_what_the_program_makes) {
  const std::filesystem::path meshes = REPOSE_MESHES;
  const Surface skin = load_surface(meshes / "paper_skin.ply", Role::skin);
  const Surface& made = paper_head().skin;
  ASSERT_EQ(skin.points.size(), made.points.size());
  EXPECT_EQ(skin.triangles, made.triangles);
  for (size_t i = 0; i < made.points.size(); ++i)
    EXPECT_LT((skin.points[i] - made.points[i]).norm(), 1e-6) << "vertex " << i;
  const Surface skull = load_surface(meshes / "paper_skull.ply", Role::bone);
  const Surface mandible = load_surface(meshes / "paper_mandible.ply", Role::bone);
  EXPECT_LT(distances(skull, paper_head().skull).second, 1);
  EXPECT_LT(distances(paper_head().skull, skull).second, 1);
  EXPECT_LT(distances(mandible, paper_head().mandible).second, 1);
  EXPECT_LT(distances(paper_head().mandible, mandible).second, 1);
}

TEST(Phantom, shipped_default_head_loads) {
  const std::filesystem::path meshes = REPOSE_MESHES;
  EXPECT_EQ(load_surface(meshes / "head_skin.ply", Role::skin).points.size(), 2000u);
  load_surface(meshes / "head_skull.ply", Role::bone);
  load_surface(meshes / "head_mandible.ply", Role::bone);
}

TEST(Phantom, is_written_whole) {
  const test::Folder folder;
  const auto files = write_phantom(folder.path("a head"), paper_head());
  EXPECT_EQ(files.size(), 7u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path("")), {}), 7);
  EXPECT_EQ(read_surface(folder.path("a head_skin.ply")).points, paper_head().skin.points);
  EXPECT_NE(refusal([&] {
              write_phantom(folder.path("none/head"), paper_head());
            }).find("cannot be written"),
            std::string::npos);
}

TEST(Solid, distances_of_simple_parts_are_exact) {
  const Vec3 point(3, 4, 0);
  EXPECT_DOUBLE_EQ(signed_distance({ellipsoid(Vec3::Zero(), Vec3(2, 2, 2), 0)}, point), 3);
  EXPECT_DOUBLE_EQ(signed_distance({chain({{{0, 0, 0}, 1}, {{3, 0, 0}, 2}}, 0)}, point), 2);
  EXPECT_DOUBLE_EQ(
      signed_distance({sheet({{{0, 0, 7}, 1}, {{9, 0, 7}, 1}, {{0, 9, 7}, 1}}, 0)}, point), 6);
  EXPECT_DOUBLE_EQ(signed_distance({ellipsoid(Vec3::Zero(), Vec3(2, 2, 2), 0)}, -point), 3);
}

TEST(Solid, soft_edges_are_soft_and_cuts_take_away) {
  EXPECT_DOUBLE_EQ(soft_min(1, 5, 2), 1);
  EXPECT_DOUBLE_EQ(soft_min(1, 1, 2), 0.5);
  EXPECT_DOUBLE_EQ(soft_max(1, 1, 2), 1.5);
  const Part ball = ellipsoid(Vec3::Zero(), Vec3(4, 4, 4), 0);
  const Part hole = cut(ellipsoid({0, -4, 0}, Vec3(2, 2, 2), 0));
  EXPECT_LT(signed_distance({ball}, {0, -3, 0}), 0);
  EXPECT_DOUBLE_EQ(signed_distance({ball, hole}, {0, -3, 0}), 1);
}

TEST(Solid, head_is_nowhere_much_steeper_than_a_distance) {
  for (double x = -90; x <= 90; x += 7.3)
    for (double y = -120; y <= 110; y += 6.7)
      for (double z = -90; z <= 140; z += 7.9)
        for (auto* distance : {mandible_distance, skull_distance, skin_distance}) {
          const Vec3 p(x, y, z);
          const double d = distance(p);
          if (d < 0 || d > 15) continue;
          for (int axis = 0; axis < 3; ++axis)
            EXPECT_LT(std::abs(distance(p + 0.1 * Vec3::Unit(axis)) - d), 0.115)
                << x << ' ' << y << ' ' << z;
        }
}

}  // namespace phantom_test
}  // namespace repose::tools::phantom
