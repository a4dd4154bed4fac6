#include "formats.h"
#include "repose/surface/defects.h"
#include "repose/surface/read.h"

namespace repose::surface {
namespace weld_test {

class Weld : public SurfaceFiles {};

TEST_F(Weld, stl_becomes_a_closed_surface) {
  for (const std::string& bytes : {stl_text(cube()), stl_binary(cube())}) {
    const Surface s = weld_and_orient(read_surface(write("cube.stl", bytes)));
    EXPECT_EQ(s.points.size(), 8u);
    EXPECT_EQ(describe(inspect(s)), "closed, 1 component, no defect");
  }
}

TEST_F(Weld, vertices_weld_within_the_tolerance_only) {
  const Surface base = tetrahedron();
  const double tolerance = 1e-9 * std::sqrt(3) * 100;
  for (const double factor : {0.9, 1.1}) {
    Surface s = base;
    s.points.push_back(base.points[3] + Vec3(0, 0, -factor * tolerance));
    s.triangles[3][2] = 4;
    const Defects d = inspect(weld_and_orient(s));
    EXPECT_EQ(d.border_edges, factor < 1 ? 0 : 4) << factor;
  }
}

TEST_F(Weld, duplicates_isolated_and_degenerate_go) {
  Surface s = cube();
  s.points.emplace_back(500, 500, 500);
  s.points.push_back(s.points[7]);
  s.triangles.push_back({3, 0, 2});
  s.triangles.push_back({3, 2, 0});
  s.triangles.push_back({7, 9, 1});
  const Surface welded = weld_and_orient(s);
  EXPECT_EQ(welded.points, cube().points);
  EXPECT_EQ(welded.triangles, cube().triangles);
}

/// A cube one of whose faces is split by a vertex on an edge, with a triangle without area
/// closing the slit.
TEST_F(Weld, a_flat_triangle_is_flipped_so_that_no_slit_opens) {
  Surface s = cube();
  s.points.emplace_back(50, 0, 0);  // on the edge 0 1
  s.triangles[1] = {0, 3, 8};
  s.triangles.push_back({8, 3, 1});
  s.triangles.push_back({0, 8, 1});
  ASSERT_EQ(describe(inspect(s, false)), "closed, 1 component, 1 degenerate triangle");
  for (const bool turned : {false, true}) {
    if (turned) turn(s.triangles.back());
    const Surface welded = weld_and_orient(s);
    EXPECT_EQ(describe(inspect(welded)), "closed, 1 component, no defect");
    EXPECT_EQ(welded.triangles.size(), 14u);
    EXPECT_NEAR(volume(welded), 1e6, 1e-6);
  }
}

TEST_F(Weld, a_row_of_flat_triangles_is_flipped_away) {
  Surface s = cube();
  s.points.emplace_back(25, 0, 0);
  s.points.emplace_back(50, 0, 0);
  s.triangles[1] = {0, 3, 8};
  for (const Triangle& t : {Triangle{8, 3, 9}, {9, 3, 1}, {0, 8, 9}, {0, 9, 1}})
    s.triangles.push_back(t);
  ASSERT_EQ(describe(inspect(s, false)), "closed, 1 component, 2 degenerate triangles");
  const Surface welded = weld_and_orient(s);
  EXPECT_EQ(describe(inspect(welded)), "closed, 1 component, no defect");
  EXPECT_NEAR(volume(welded), 1e6, 1e-6);
}

TEST_F(Weld, no_flip_makes_a_non_manifold_edge) {
  const Surface folded{"folded",
                       {{0, 0, 0}, {100, 0, 0}, {50, 0, 0}, {50, 80, 0}},
                       {{0, 1, 2}, {1, 0, 3}, {2, 1, 3}, {0, 2, 3}}};
  EXPECT_EQ(inspect(weld_and_orient(folded)).non_manifold_edges, 0);
}

TEST_F(Weld, closed_surfaces_turn_outwards) {
  Surface s = both(cube(), cube(Vec3(300, 0, 0)));
  for (size_t t = 5; t < s.triangles.size(); t += 2) turn(s.triangles[t]);
  for (size_t t = 0; t < 12; ++t) turn(s.triangles[t]);
  const Surface welded = weld_and_orient(s);
  EXPECT_EQ(describe(inspect(welded)), "closed, 2 components, no defect");
  EXPECT_NEAR(volume(welded), 2e6, 1e-6);
}

TEST_F(Weld, the_wall_of_a_cavity_faces_the_cavity) {
  Surface s = both(cube(), cube(Vec3(20, 20, 20), 60));
  s = both(s, cube(Vec3(40, 40, 40), 20));
  const Surface welded = weld_and_orient(s);
  EXPECT_NEAR(volume(welded), 1e6 - 216e3 + 8e3, 1e-6);
  EXPECT_EQ(describe(inspect(welded)), "closed, 3 components, no defect");
}

TEST_F(Weld, an_open_patch_keeps_its_majority) {
  for (const bool down : {false, true}) {
    Surface s = patch(4), requested = patch(4);
    for (size_t t = 0; t < s.triangles.size(); ++t)
      if ((t % 3 == 0) != down) turn(s.triangles[t]);
    const Surface welded = weld_and_orient(s);
    EXPECT_EQ(inspect(welded).misoriented_edges, 0);
    for (const auto& t : welded.triangles) {
      const Vec3 &a = welded.points[t[0]], &b = welded.points[t[1]], &c = welded.points[t[2]];
      EXPECT_EQ((b - a).cross(c - a).z() < 0, down);
    }
  }
}

TEST_F(Weld, crowded_and_coinciding_points) {
  Surface s{"crowd", {}, {}};
  for (int i = 0; i < 300; ++i) s.points.emplace_back(1e-7 * i, 0, 0);
  s.points.emplace_back(1000, 0, 0);
  s.points.emplace_back(0, 1000, 0);
  for (int64_t i = 0; i < 300; ++i) s.triangles.push_back({i, 300, 301});
  EXPECT_LE(weld_and_orient(s).points.size(), 302u);
  const Surface spot{"spot", {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}}};
  EXPECT_TRUE(weld_and_orient(spot).triangles.empty());
}

}  // namespace weld_test
}  // namespace repose::surface
