#include "repose/surface/defects.h"

#include "repose/surface/intersections.h"

#include "shapes.h"

namespace repose::surface {
namespace defects_test {

TEST(Defects, closed_surfaces_have_none) {
  for (const Surface& s : {tetrahedron(), cube()}) {
    const Defects d = inspect(s);
    EXPECT_EQ(describe(d), "closed, 1 component, no defect") << s.name;
    EXPECT_TRUE(d.outward);
  }
}

TEST(Defects, an_open_patch_has_one_border) {
  const Defects d = inspect(patch(4));
  EXPECT_EQ(describe(d), "open, 1 border loop, 16 border edges, 1 component, no defect");
  EXPECT_FALSE(d.outward);
}

TEST(Defects, every_hole_is_a_loop) {
  Surface s = cube();
  s.triangles.erase(s.triangles.begin());
  EXPECT_EQ(inspect(s).border_loops, 1);
  EXPECT_EQ(inspect(s).border_edges, 3);
  s.triangles.erase(s.triangles.begin() + 2);
  EXPECT_EQ(inspect(s).border_loops, 2);
  EXPECT_EQ(inspect(s).border_edges, 6);
}

/// As if each of the two fans at the vertex had a vertex of its own.
TEST(Defects, holes_that_touch_in_a_vertex_are_one_loop) {
  Surface s = patch(4);
  std::erase_if(s.triangles, [](const Triangle& t) {
    return t == Triangle{6, 7, 12} || t == Triangle{12, 13, 18};
  });
  const Defects d = inspect(s);
  EXPECT_EQ(d.border_loops, 2);
  EXPECT_EQ(d.border_edges, 16 + 6);
  EXPECT_EQ(d.non_manifold_vertices, 1);
  EXPECT_EQ(d.first_non_manifold_vertex, 12);
}

TEST(Defects, a_fin_makes_a_non_manifold_edge) {
  Surface s = patch(4);
  s.points.emplace_back(15, 15, 20);
  s.triangles.push_back({6, 12, 25});
  const Defects d = inspect(s);
  EXPECT_EQ(d.non_manifold_edges, 1);
  EXPECT_EQ(d.first_non_manifold_edge[0], 6);
  EXPECT_EQ(d.first_non_manifold_edge[1], 12);
  EXPECT_EQ(d.non_manifold_vertices, 2);
  EXPECT_EQ(d.components, 1);
  EXPECT_EQ(d.self_intersections, 0);
}

TEST(Defects, a_bow_tie_is_a_non_manifold_vertex_and_two_components) {
  const Surface s{"bow tie",
                  {{0, 0, 0}, {10, 5, 0}, {10, -5, 0}, {-10, 5, 0}, {-10, -5, 0}},
                  {{0, 2, 1}, {0, 3, 4}}};
  const Defects d = inspect(s);
  EXPECT_EQ(d.non_manifold_vertices, 1);
  EXPECT_EQ(d.first_non_manifold_vertex, 0);
  EXPECT_EQ(d.components, 2);
  EXPECT_EQ(d.border_loops, 2);
  EXPECT_EQ(d.self_intersections, 0);
}

TEST(Defects, crossing_triangles_are_counted_in_pairs) {
  Surface s = both(patch(1), {"", {{1, 5, -5}, {2, 5, -5}, {1, 5, 5}}, {{0, 1, 2}}});
  EXPECT_EQ(inspect(s).self_intersections, 1);
  EXPECT_EQ(self_intersections(s).front(), std::pair(int64_t{1}, int64_t{2}));
  s.points[5].x() = 9;
  EXPECT_EQ(inspect(s).self_intersections, 2);
  EXPECT_EQ(inspect(s, false).self_intersections, 0);
}

TEST(Defects, neighbors_that_fold_or_pierce_are_self_intersections) {
  const Surface fold{
      "fold", {{0, 0, 0}, {10, 0, 0}, {5, 10, 0}, {5, 4, 0}}, {{0, 1, 2}, {1, 0, 3}}};
  EXPECT_EQ(inspect(fold).self_intersections, 1);
  const Surface pierce{"pierce",
                       {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {9, 9, -5}, {-1, -1, 5}, {4, 4, 6}},
                       {{0, 1, 2}, {0, 3, 5}}};
  EXPECT_EQ(inspect(pierce).self_intersections, 1);
  const Surface twice{"twice", {{0, 0, 0}, {10, 0, 0}, {5, 10, 0}}, {{0, 1, 2}, {1, 0, 2}}};
  EXPECT_EQ(inspect(twice).self_intersections, 1);
}

TEST(Defects, seams_of_unwelded_triangles_are_no_self_intersections) {
  Surface torn{"torn", {}, {}};
  const Surface whole = cube();
  for (const auto& t : whole.triangles) {
    const auto n = static_cast<int64_t>(torn.points.size());
    for (const int64_t v : t) torn.points.push_back(whole.points[v]);
    torn.triangles.push_back({n, n + 1, n + 2});
  }
  const Defects d = inspect(torn);
  EXPECT_EQ(d.self_intersections, 0);
  EXPECT_EQ(d.duplicate_vertices, 36 - 8);
  EXPECT_EQ(d.components, 12);
  EXPECT_EQ(d.border_loops, 12);
}

TEST(Defects, components_duplicates_and_isolated_vertices) {
  Surface s = both(cube(), cube(Vec3(300, 0, 0)));
  EXPECT_EQ(describe(inspect(s)), "closed, 2 components, no defect");
  const double diagonal = Vec3(400, 100, 100).norm();
  s.points.push_back(s.points[3] + Vec3(0.5e-9 * diagonal, 0, 0));
  s.points.push_back(s.points[3] + Vec3(0, 2e-9 * diagonal, 0));
  s.points.push_back(s.points[9]);
  const Defects d = inspect(s);
  EXPECT_EQ(d.components, 2);
  EXPECT_EQ(d.duplicate_vertices, 2);
  EXPECT_EQ(d.isolated_vertices, 3);
  EXPECT_EQ(describe(d), "closed, 2 components, 2 duplicate vertices, 3 isolated vertices");
}

TEST(Defects, degenerate_triangles) {
  Surface s = patch(2);
  s.triangles.push_back({0, 1, 2});
  EXPECT_EQ(inspect(s).degenerate_triangles, 1);
  s.triangles.push_back({4, 4, 5});
  const Defects d = inspect(s);
  EXPECT_EQ(d.degenerate_triangles, 2);
  EXPECT_EQ(d.components, 1);
}

TEST(Defects, misoriented_edges_and_inside_out) {
  Surface s = cube();
  turn(s.triangles[4]);
  EXPECT_EQ(inspect(s).misoriented_edges, 3);
  EXPECT_FALSE(inspect(s).outward);
  s = cube();
  for (auto& t : s.triangles) turn(t);
  EXPECT_EQ(describe(inspect(s)), "closed, 1 component, turned inside out or flat");
}

TEST(Defects, unsound_arrays_and_nothing_at_all) {
  EXPECT_EQ(describe(inspect({"nothing", {}, {}})), "no triangles, no defect");
  Surface s = cube();
  s.triangles[3][1] = 8;
  EXPECT_NE(refusal([&] { inspect(s); }).find("cube: triangle 3 names vertex 8"),
            std::string::npos);
  s = cube();
  s.points[2].z() = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusal([&] { inspect(s); }).find("cube: vertex 2"), std::string::npos);
}

/// A sheet that is folded over its middle, so that its far edge comes through the near half.
TEST(NewIntersections, a_fold_is_found_and_what_met_before_is_not) {
  const Surface flat = patch(6);
  EXPECT_TRUE(new_intersections(flat, flat).empty());
  Surface folded = flat;
  for (Vec3& p : folded.points)
    if (p.x() > 25) p = {25 - 0.8 * (p.x() - 25), p.y() + 1, 12 - 0.6 * (p.x() - 25)};
  const auto pairs = new_intersections(flat, folded);
  EXPECT_FALSE(pairs.empty());
  EXPECT_EQ(pairs, self_intersections(folded));
  EXPECT_TRUE(new_intersections(folded, folded).empty());
}

}  // namespace defects_test
}  // namespace repose::surface
