#include "repose/meshtools/osteotomy.h"

#include <map>
#include <random>

#include "../surface/shapes.h"
#include "repose/surface/defects.h"
#include "repose/surface/read.h"

namespace repose::meshtools {
using namespace surface;
namespace osteotomy_test {

Osteotomy by_plane(const Vec3& point, const Vec3& normal, double kerf = 0) {
  return {"part", {{point, normal}}, {}, kerf, {}};
}

void expect_sound(const Surface& part) {
  EXPECT_EQ(part.triangles.empty(), false) << part.name;
  const Defects d = inspect(part);
  EXPECT_TRUE(d.outward) << part.name;
  EXPECT_EQ(describe(d).find("closed, "), 0u) << part.name << ": " << describe(d);
  EXPECT_NE(describe(d).find("no defect"), std::string::npos) << part.name << ": " << describe(d);
  const Surface again = weld_and_orient(part);
  EXPECT_EQ(again.triangles.size(), part.triangles.size()) << part.name << " is welded further";
}

/// Cuts, checks parts and volumes.
Pieces cut(const Surface& bone, const Osteotomy& plan) {
  const Pieces pieces = cut_bone(bone, plan);
  expect_sound(pieces.piece);
  expect_sound(pieces.rest);
  EXPECT_NEAR(volume(pieces.piece) + volume(pieces.rest) + pieces.kerf_volume, volume(bone),
              1e-11 * volume(bone));
  EXPECT_EQ(pieces.piece.name, plan.piece);
  EXPECT_EQ(pieces.rest.name, bone.name);
  return pieces;
}

/// A bumpy solid, whose cuts are curves: a fine cube pushed about.
Surface boulder(int n = 12) {
  Surface s = cube({-50, -50, -50}, 100);
  for (int round = 0; (1 << round) < n; ++round) {
    Surface fine{s.name, s.points, {}};
    std::map<std::pair<int64_t, int64_t>, int64_t> middles;
    const auto middle = [&](int64_t a, int64_t b) {
      const auto [found, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<int64_t>(fine.points.size()));
      if (is_new) fine.points.push_back((s.points[a] + s.points[b]) / 2);
      return found->second;
    };
    for (const auto& [a, b, c] : s.triangles) {
      const int64_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const Triangle& t : {Triangle{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
        fine.triangles.push_back(t);
    }
    s = fine;
  }
  for (Vec3& p : s.points)
    p = p.normalized() * (50 + 6 * std::sin(p.x() / 9) * std::cos(p.y() / 7 + p.z() / 11));
  return s;
}

Surface turned(Surface s) {
  for (auto& t : s.triangles) turn(t);
  return s;
}

/// A rectangle from corner to corner + a + b, normal a × b.
Surface rectangle(const Vec3& corner, const Vec3& a, const Vec3& b) {
  return {"rectangle", {corner, corner + a, corner + a + b, corner + b}, {{0, 1, 2}, {0, 2, 3}}};
}

TEST(Osteotomy, halves_a_cube) {
  const Pieces p = cut(cube(), by_plane({50, 50, 30}, {0, 0, 2}));
  EXPECT_NEAR(volume(p.piece), 7e5, 1e-6);
  EXPECT_NEAR(volume(p.rest), 3e5, 1e-6);
  EXPECT_EQ(p.kerf_volume, 0);
  EXPECT_TRUE(p.remarks.empty());
}

TEST(Osteotomy, the_kerf_is_taken_half_on_either_side) {
  const Pieces p = cut(cube(), by_plane({0, 0, 30}, {0, 0, -1}, 0.8));
  EXPECT_NEAR(volume(p.piece), 1e4 * 29.6, 1e-6);
  EXPECT_NEAR(volume(p.rest), 1e4 * 69.6, 1e-6);
  EXPECT_NEAR(p.kerf_volume, 1e4 * 0.8, 1e-6);
}

TEST(Osteotomy, two_planes_cut_a_wedge_and_leave_no_other_trace) {
  Osteotomy plan = by_plane({0, 0, 60}, {0, 0, 1});
  plan.planes.push_back({{0, 30, 0}, {0, -1, 0}});
  const Pieces p = cut(cube(), plan);
  EXPECT_NEAR(volume(p.piece), 100 * 30 * 40, 1e-6);
  plan.kerf = 2;
  const Pieces sawn = cut(cube(), plan);
  EXPECT_NEAR(volume(sawn.piece), 100 * 29 * 39, 1e-6);
  EXPECT_NEAR(sawn.kerf_volume, 100 * (31 * 41 - 29 * 39), 1e-6);
  EXPECT_EQ(inspect(sawn.rest).components, 1);
}

TEST(Osteotomy, a_segment_between_two_planes) {
  Osteotomy plan = by_plane({20, 0, 0}, {1, 0, 0}, 1);
  plan.planes.push_back({{70, 0, 0}, {-1, 0.1, 0}});
  const Pieces p =
      cut(boulder(), {"part", {{{-20, 0, 0}, {1, 0, 0}}, {{15, 0, 0}, {-1, 0.1, 0}}}, {}, 1, {}});
  EXPECT_EQ(inspect(p.rest).components, 2);
  EXPECT_EQ(inspect(p.piece).components, 1);
}

TEST(Osteotomy, a_seed_chooses_the_piece) {
  Osteotomy plan = by_plane({0, 0, 60}, {0, 0, 1});
  plan.planes.push_back({{0, 30, 0}, {0, -1, 0}});
  plan.seed = Vec3(50, 70, 20);
  EXPECT_NEAR(volume(cut(cube(), plan).piece), 100 * 70 * 60, 1e-6);
  plan.kerf = 2;
  const Pieces p = cut(cube(), plan);
  EXPECT_NEAR(volume(p.piece), 100 * 69 * 59, 1e-6);
  EXPECT_NEAR(p.kerf_volume, 100 * (2 * 100 + 2 * 100 - 4), 1e-6);
  EXPECT_EQ(inspect(p.rest).components, 3);
}

TEST(Osteotomy, a_disc_cuts_within_its_radius_only) {
  const Surface dumbbell = both(cube(), cube({150, 0, 0}));
  Osteotomy plan{"part", {{{50, 50, 50}, {0, 0, 1}, 80}}, {}, 0, {}};
  EXPECT_NEAR(volume(cut(dumbbell, plan).piece), 5e5, 1e-6) << "the other cube stays whole";
  plan.kerf = 1;
  const Pieces p = cut(dumbbell, plan);
  EXPECT_NEAR(p.kerf_volume, 1e4, 1e-6);
  EXPECT_NEAR(volume(p.rest), 1e6 + 49.5 * 1e4, 1e-6);
  plan.planes[0].radius = 60;
  for (const double kerf : {0.0, 1.0}) {
    plan.kerf = kerf;
    const std::string why = refusal([&] { cut_bone(dumbbell, plan); });
    EXPECT_NE(why.find("part"), std::string::npos) << why;
    EXPECT_NE(why.find(kerf > 0 ? "comes out empty" : "ends inside the bone"), std::string::npos)
        << why;
  }
}

TEST(Osteotomy, a_folded_surface_cuts_a_step) {
  // Seen along y: in at z = 70, down along x = 50, out at z = 30.
  Surface step{"step",
               {{-9, -9, 70},
                {50, -9, 70},
                {50, -9, 30},
                {120, -9, 30},
                {-9, 120, 70},
                {50, 120, 70},
                {50, 120, 30},
                {120, 120, 30}},
               {{0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}}};
  Osteotomy plan{"part", {}, step, 0, {}};
  EXPECT_NEAR(volume(cut(cube(), plan).piece), 1e4 * 15 + 1e4 * 35, 1e-6);
  plan.kerf = 2;
  const Pieces p = cut(cube(), plan);
  EXPECT_NEAR(volume(p.piece), 100 * (51 * 29 + 49 * 69), 1e-6);
  EXPECT_NEAR(volume(p.rest), 100 * (49 * 69 + 51 * 29), 1e-6);
}

TEST(Osteotomy, a_closed_surface_cuts_out_what_lies_within) {
  Osteotomy plan{"part", {}, cube({60, 60, 60}, 80), 0, Vec3(80, 80, 80)};
  EXPECT_NEAR(volume(cut(cube(), plan).piece), 40 * 40 * 40, 1e-6);
}

TEST(Osteotomy, shells_that_no_cut_meets) {
  const Surface cave = turned(cube({40, 40, 10}, 15)), sheath = cube({40, 40, 70}, 15);
  const Surface bone = both(both(cube(), cave), turned(sheath));
  const Pieces p = cut(bone, by_plane({0, 0, 50}, {0, 0, 1}));
  EXPECT_NEAR(volume(p.piece), 5e5 - 3375, 1e-6);
  EXPECT_NEAR(volume(p.rest), 5e5 - 3375, 1e-6);
  Osteotomy seeded = by_plane({0, 0, 50}, {0, 0, -1});
  seeded.seed = Vec3(20, 20, 80);
  EXPECT_NEAR(volume(cut(bone, seeded).piece), 5e5 - 3375, 1e-6) << "its cavity is known by place";
  const Surface with_tooth = both(cube(), cube({40, 40, 105}, 15));
  EXPECT_NEAR(volume(cut(with_tooth, by_plane({0, 0, 50}, {0, 0, 1})).piece), 5e5 + 3375, 1e-6);
  EXPECT_NEAR(volume(cut(with_tooth, by_plane({0, 0, 50}, {0, 0, -1})).piece), 5e5, 1e-6);
}

TEST(Osteotomy, pieces_can_be_cut_again) {
  Surface rest = boulder();
  double sum = 0;
  for (const Vec3& normal : {Vec3(1, 0.2, 0.1), Vec3(-1, 0.1, 0.3), Vec3(0.1, 1, 0.1)}) {
    const Pieces p = cut(rest, by_plane(15 * normal, normal, 0.5));
    sum += volume(p.piece) + p.kerf_volume;
    rest = p.rest;
  }
  EXPECT_NEAR(sum + volume(rest), volume(boulder()), 1e-6);
}

TEST(Osteotomy, planes_through_vertices_and_along_edges) {
  const Surface bone = boulder(8);
  for (size_t i = 0; i < bone.points.size(); i += 29)
    for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 1, 0), bone.points[i].cross(Vec3(0, 1, 0))})
      if (normal.norm() > 1) cut(bone, by_plane(bone.points[i] * 0.9, normal));
  cut(cube(), by_plane({50, 50, 50}, {1, -1, 0}));
  cut(cube(), by_plane({0, 0, 0}, {1, 1, -1}));
}

TEST(Osteotomy, random_planes) {
  std::mt19937 engine(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random = [&] { return Vec3(uniform(engine), uniform(engine), uniform(engine)); };
  const Surface bone = boulder(8);
  for (int i = 0; i < 40; ++i) cut(bone, by_plane(25 * random(), random(), i % 2 ? 0 : 0.7));
}

TEST(Osteotomy, refuses_in_one_line) {
  const auto refused = [](const Surface& bone, const Osteotomy& plan) {
    const std::string why = refusal([&] { cut_bone(bone, plan); });
    EXPECT_EQ(why.find('\n'), std::string::npos);
    return why;
  };
  const auto holds = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  holds(refused(cube(), by_plane({0, 0, 120}, {0, 0, 1})),
        "misses the bone, which lies -120.0 to -20.0 mm in front");
  holds(refused(cube(), {"part", {}, rectangle({200, 0, 0}, {9, 0, 0}, {0, 9, 0}), 0, {}}),
        "misses the bone");
  holds(refused(cube(), {"part", {}, rectangle({-9, -9, 50}, {60, 0, 0}, {0, 200, 0}), 0, {}}),
        "ends inside the bone");
  holds(refused(cube(), {"part", {{{0, 0, 60}, {0, 0, 1}}, {{0, 0, 30}, {0, 0, -1}}}, {}, 0, {}}),
        "comes out empty");
  holds(refused(cube(), {"part", {}, {}, 0, {}}), "no cut");
  holds(refused(cube(), by_plane({0, 0, 50}, {0, 0, 0})), "normal without length");
  holds(refused(patch(), by_plane({20, 20, 0}, {1, 0, 0})), "closed");
  Osteotomy seeded = by_plane({0, 0, 50}, {0, 0, 1}, 2);
  seeded.seed = Vec3(50, 50, 110);
  holds(refused(cube(), seeded), "not inside the bone");
  seeded.seed = Vec3(50, 50, 50.5);
  holds(refused(cube(), seeded), "in the kerf");
  const Surface two = both(cube(), cube({0, 0, 200}, 100));
  seeded.seed = Vec3(50, 50, 250);
  holds(refused(two, seeded), "in a component that no cut meets");
  holds(refused(two, by_plane({0, 0, 150}, {0, 0, 1})), "lies on both sides of its plane");
}

TEST(Osteotomy, a_plane_along_a_face_misses_or_is_refused) {
  for (const double sign : {1.0, -1.0}) {
    const std::string why = refusal([&] { cut_bone(cube(), by_plane({0, 0, 100}, {0, 0, sign})); });
    EXPECT_NE(why.find("runs along"), std::string::npos) << why;
  }
}

TEST(Osteotomy, bones_that_intersect_themselves) {
  const Surface crossed = both(boulder(8), cube({20, 20, 20}, 60));
  const std::string why = refusal([&] { cut_bone(crossed, by_plane({0, 0, 30}, {0.1, 0, 1})); });
  EXPECT_NE(why.find("intersects itself"), std::string::npos) << why;
  const Pieces away = cut_bone(crossed, by_plane({0, 0, -20}, {0.1, 0, 1}));
  EXPECT_TRUE(inspect(away.piece).outward);
  EXPECT_TRUE(inspect(away.rest).outward);
}

class RealBones : public ::testing::TestWithParam<const char*> {};

TEST_P(RealBones, random_cuts_of_real_bones) {
  const std::filesystem::path file = std::filesystem::path(REPOSE_HEAD_DATA) / GetParam();
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no real head: " << file << " is missing";
  const Surface bone = load_surface(file, Role::bone);
  std::mt19937 engine(3);
  std::uniform_int_distribution<size_t> vertex(0, bone.points.size() - 1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 4; ++i)
    cut(bone, by_plane(bone.points[vertex(engine)],
                       {normal(engine), normal(engine), normal(engine)}, i % 2 ? 0.8 : 0));
}

INSTANTIATE_TEST_SUITE_P(Osteotomy, RealBones, ::testing::Values("mandible.ply", "skull.ply"));

}  // namespace osteotomy_test
}  // namespace repose::meshtools
