#include "formats.h"
#include "repose/surface/defects.h"
#include "repose/surface/read.h"

namespace repose::surface {
namespace load_test {

class Load : public SurfaceFiles {
 protected:
  std::string refused(const Surface& s, Role role) const {
    const auto file = write("mesh.off", off_text(s));
    const std::string message = refusal([&] { load_surface(file, role); });
    EXPECT_NE(message.find("mesh.off: "), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
};

testing::AssertionResult says(const std::string& message, const std::string& part) {
  if (message.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "\"" << message << "\" lacks \"" << part << "\"";
}

Surface scaled(Surface s, double factor) {
  for (auto& p : s.points) p *= factor;
  return s;
}

TEST_F(Load, good_surfaces_of_either_role) {
  const auto open = write("open.off", off_text(patch()));
  EXPECT_EQ(load_surface(open, Role::skin).triangles, patch().triangles);
  const auto two = write("two.off", off_text(both(cube(), cube(Vec3(300, 0, 0)))));
  EXPECT_EQ(inspect(load_surface(two, Role::bone)).components, 2);
  EXPECT_EQ(load_surface(write("cube.stl", stl_binary(cube())), Role::skin).points.size(), 8u);
}

TEST_F(Load, a_turned_bone_comes_back_outward) {
  Surface s = cube();
  for (auto& t : s.triangles) turn(t);
  EXPECT_TRUE(inspect(load_surface(write("in.off", off_text(s)), Role::bone)).outward);
}

TEST_F(Load, meters_and_micrometers) {
  const std::string meters = refused(scaled(cube(), 1e-3), Role::skin);
  EXPECT_TRUE(says(meters, "0.1732 mm across"));
  EXPECT_TRUE(says(meters, "in meters; scale the mesh to millimeters (times 1000)"));
  EXPECT_TRUE(says(refused(scaled(cube(), 1e3), Role::bone), "in micrometers; scale the mesh"));
  const double side = 2 / std::sqrt(3);
  EXPECT_EQ(load_surface(write("small.off", off_text(cube(Vec3::Zero(), 1.001 * side))), Role::bone)
                .points.size(),
            8u);
  EXPECT_TRUE(says(refused(cube(Vec3::Zero(), 0.999 * side), Role::bone), "in meters"));
}

TEST_F(Load, non_manifold_edges_and_vertices_of_either_role) {
  Surface fin = cube();
  fin.points.emplace_back(50, 50, 200);
  fin.triangles.push_back({4, 7, 8});
  Surface pinched = cube();
  for (const Vec3& p : {Vec3(200, 150, 150), Vec3(150, 200, 150), Vec3(150, 150, 200)})
    pinched.points.push_back(p);
  for (const Triangle& t : {Triangle{7, 9, 8}, {7, 8, 10}, {7, 10, 9}, {8, 9, 10}})
    pinched.triangles.push_back(t);
  for (const Role role : {Role::skin, Role::bone}) {
    EXPECT_TRUE(says(refused(fin, role), "1 non-manifold edge(s)"));
    EXPECT_TRUE(says(refused(fin, role), "from (0.00, 0.00, 100.00) mm to (100.00, 100.00"));
    EXPECT_TRUE(says(refused(pinched, role), "1 non-manifold vertex(es)"));
    EXPECT_TRUE(says(refused(pinched, role), "first at (100.00, 100.00, 100.00) mm"));
  }
  EXPECT_TRUE(says(refused(fin, Role::mesh), "1 non-manifold edge(s)"));
  const Surface parted = load_surface(write("pinched.off", off_text(pinched)), Role::mesh);
  EXPECT_EQ(parted.points.size(), pinched.points.size() + 1) << "a point for each sheet";
  EXPECT_EQ(inspect(parted).non_manifold_vertices, 0);
  EXPECT_EQ(inspect(parted).components, 2);
}

TEST_F(Load, a_moebius_strip_has_no_orientation) {
  Surface strip{"strip", {}, {}};
  constexpr int n = 12;
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * M_PI * i / n, lean = turn / 2;
    for (const double w : {-20.0, 20.0})
      strip.points.emplace_back((100 + w * std::cos(lean)) * std::cos(turn),
                                (100 + w * std::cos(lean)) * std::sin(turn), w * std::sin(lean));
  }
  for (int64_t i = 0; i < n; ++i) {
    const int64_t a = 2 * i, b = a + 1;
    const int64_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
    strip.triangles.push_back({a, b, c});
    strip.triangles.push_back({b, d, c});
  }
  EXPECT_TRUE(says(refused(strip, Role::skin), "no consistent orientation"));
}

TEST_F(Load, a_skin_in_pieces_and_an_open_bone) {
  EXPECT_TRUE(says(refused(both(patch(), cube(Vec3(0, 0, 50))), Role::skin),
                   "2 separate components (the largest of 32 and 12 triangles)"));
  Surface open = cube();
  open.triangles.erase(open.triangles.begin() + 3);
  open.triangles.erase(open.triangles.begin());
  EXPECT_TRUE(says(refused(open, Role::bone), "2 border loop(s) of 6 edges"));
  EXPECT_TRUE(says(refused(open, Role::bone), "fill the holes"));
}

TEST_F(Load, nothing_but_flat_triangles) {
  const Surface line{"line", {{0, 0, 0}, {50, 0, 0}, {100, 0, 0}}, {{0, 1, 2}}};
  EXPECT_TRUE(says(refused(line, Role::skin), "none of its 1 triangles has an area"));
}

}  // namespace load_test
}  // namespace repose::surface
