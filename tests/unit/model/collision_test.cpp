#include "repose/model/collision.h"

#include <gtest/gtest.h>

#include <cmath>

#include "repose/base/error.h"
#include "repose/meshtools/osteotomy.h"
#include "repose/surface/component.h"

namespace repose::model {
namespace collision_test {

using scene::RigidMotion;

/// A box from `low` to `low` + `size`.
surface::Surface box(const std::string& name, const Vec3& low, const Vec3& size) {
  surface::Surface s{name, {}, {}};
  for (int i = 0; i < 8; ++i)
    s.points.push_back(low + size.cwiseProduct(Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1)));
  s.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return s;
}

scene::Scene scene_of(const std::vector<surface::Surface>& bones,
                      const std::vector<RigidMotion>& moves) {
  scene::Scene scene;
  scene.file = "plan.yaml";
  for (const surface::Surface& bone : bones) scene.bones.push_back({bone.name, {}});
  scene.moves = moves;
  return scene;
}

const std::vector<surface::Surface> jaws = {box("upper", {0, 0, 40}, {50, 50, 30}),
                                            box("lower", {0, 5, 0}, {50, 40, 30})};

/// All warnings of a scene, whose contacts are resolved.
std::vector<std::string> warnings_of(const std::vector<surface::Surface>& bones,
                                     scene::Scene& scene, std::vector<std::string>& remarks) {
  std::vector<std::string> warnings;
  const std::vector<std::string> of_moves = resolve_collisions(bones, scene, remarks, warnings);
  warnings.insert(warnings.end(), of_moves.begin(), of_moves.end());
  return warnings;
}

TEST(Collisions, a_translation_stops_where_the_gap_is_used_up) {
  const std::vector<RigidMotion> moves = {{}, RigidMotion::translation({3, 0, 16})};
  for (const double clearance : {0.0, 1.0})
    for (const double tolerance : {0.05, 0.001}) {
      const CollisionReport report =
          follow_moves(jaws, moves, {scene::CollisionMode::report, clearance, tolerance});
      ASSERT_EQ(report.pairs.size(), 1u);
      const BonePair& pair = report.pairs[0];
      const double contact = (10 - clearance) / 16;
      EXPECT_NEAR(pair.gap, 10, 1e-12);
      EXPECT_LE(pair.load, contact);
      EXPECT_GE(pair.load, contact - tolerance / 16);
      EXPECT_EQ(report.safe_load, pair.load);
      EXPECT_NEAR(pair.depth, 6, 1e-9) << "in the middle of a side";
      EXPECT_GT(pair.crossings, 0);
      EXPECT_EQ(pair.ignored, 0);
    }
}

TEST(Collisions, a_turn_stops_at_its_angle) {
  // The far upper edge of the lower box rises about the near lower edge at the origin.
  const double length = std::hypot(45, 30), start = std::atan2(30, 45),
               contact = std::asin(40 / length) - start;
  const double angle = 30 * M_PI / 180, tolerance = 0.01;
  const std::vector<RigidMotion> moves = {{}, RigidMotion::rotation({1, 0, 0}, {0, 0, 0}, 30)};
  const CollisionReport report =
      follow_moves(jaws, moves, {scene::CollisionMode::report, 0, tolerance});
  EXPECT_LE(report.safe_load * angle, contact);
  EXPECT_GT(report.safe_load * angle, contact - 2 * tolerance / 42);
}

TEST(Collisions, bones_that_move_together_are_left_out) {
  const RigidMotion turn = RigidMotion::rotation({1, 2, 3}, {4, 5, 6}, 70);
  EXPECT_TRUE(follow_moves(jaws, {turn, turn}, {}).pairs.empty());
  EXPECT_EQ(follow_moves(jaws, {turn, turn}, {}).safe_load, 1);
}

/// Both bones move; the lower meets the upper half way.
TEST(Collisions, both_may_move) {
  const CollisionReport report = follow_moves(
      jaws, {RigidMotion::translation({0, 0, -10}), RigidMotion::translation({0, 0, 10})},
      {scene::CollisionMode::report, 0, 0.01});
  EXPECT_NEAR(report.safe_load, 0.5, 0.001);
  EXPECT_NEAR(report.pairs[0].at.z(), 35, 0.1);
}

TEST(Collisions, a_fresh_cut_may_part_and_slide_but_not_press) {
  const meshtools::Pieces parts = meshtools::cut_bone(
      box("bone", {0, 0, 0}, {60, 50, 40}), {"piece", {{{30, 0, 0}, {1, 0, 0.5}}}, {}, 0, {}});
  const auto report = [&](const Vec3& translation) {
    return follow_moves({parts.rest, parts.piece}, {{}, RigidMotion::translation(translation)}, {});
  };
  EXPECT_EQ(report({5, 0, 0}).safe_load, 1) << "apart";
  EXPECT_EQ(report({-2, 0, 4}).safe_load, 1) << "along the cut";
  const CollisionReport pressed = report({-5, 0, 0});
  EXPECT_LT(pressed.safe_load, 0.5);
  EXPECT_GT(pressed.pairs[0].crossings, 0);
  EXPECT_GT(pressed.pairs[0].ignored, 0);
}

TEST(Collisions, bones_that_overlap_may_part_but_not_press) {
  for (const double overlap : {0.15, 2.0}) {
    const std::vector<surface::Surface> bones = {box("upper", {0, 0, 30 - overlap}, {50, 50, 30}),
                                                 box("lower", {5, 5, 0}, {40, 40, 30})};
    const auto safe = [&](const Vec3& translation) {
      return follow_moves(bones, {{}, RigidMotion::translation(translation)}, {}).safe_load;
    };
    EXPECT_EQ(safe({0, 0, -10}), 1) << "apart";
    EXPECT_NEAR(safe({0, 0, 4}), 0.1 / 4, 0.003) << "deeper by 0.1 mm";
  }
}

TEST(Collisions, bones_overlap_between_their_vertices) {
  const std::vector<surface::Surface> bars = {box("upper", {-25, -5, 0}, {50, 10, 10}),
                                              box("lower", {-5, -25, -5}, {10, 50, 10})};
  const CollisionReport report = follow_moves(bars, {{}, RigidMotion::translation({0, 0, 1})}, {});
  EXPECT_NEAR(-report.pairs[0].gap, 5, 1);
}

/// Surfaces of bones of which one lies inside the other do not touch.
TEST(Collisions, a_bone_inside_another_overlaps_it) {
  const surface::Surface outer = box("upper", {-15, 0, 0}, {60, 20, 20}),
                         inner = box("lower", {5, 5, 5}, {20, 10, 10});
  surface::Surface parts =
      box("lower", {80, 0, 0}, {9, 9, 9});  // beside the outer one, then inside
  surface::append(inner, parts);
  const std::vector<RigidMotion> moves = {{}, RigidMotion::translation({1, 0, 0})};
  for (const surface::Surface& bone : {inner, parts})
    for (const std::vector<surface::Surface>& bones : {std::vector{outer, bone}, {bone, outer}}) {
      scene::Scene scene = scene_of(bones, moves);
      std::vector<std::string> remarks;
      const std::vector<std::string> warnings = warnings_of(bones, scene, remarks);
      ASSERT_EQ(warnings.size(), 2u);
      EXPECT_NE(warnings[0].find("lie 10.0 mm inside one another before they move"),
                std::string::npos)
          << warnings[0];
      EXPECT_NE(warnings[1].find("end 10.0 mm inside one another"), std::string::npos)
          << warnings[1];
      const CollisionReport report = follow_moves(bones, moves, {});
      EXPECT_NEAR(report.pairs[0].gap, -10, 1e-9);
      EXPECT_NE(describe(report, scene, {})[0].find(
                    "10.00 mm inside one another at the start: go no deeper"),
                std::string::npos);
    }
}

TEST(Collisions, a_bone_that_ends_inside_another_overlaps_it) {
  const std::vector<surface::Surface> bones = {box("upper", {0, 0, 0}, {30, 30, 30}),
                                               box("lower", {5, 5, 50}, {20, 20, 20})};
  const std::vector<RigidMotion> moves = {{}, RigidMotion::translation({0, 0, -45})};
  const CollisionReport report = follow_moves(bones, moves, {});
  EXPECT_EQ(report.pairs[0].crossings, 0);
  EXPECT_NEAR(report.pairs[0].depth, 5, 1e-9);
  const std::string line = describe(report, scene_of(bones, moves), {})[0];
  EXPECT_NE(line.find("at the end 0 pairs of triangles cross, 5.00 mm deep"), std::string::npos)
      << line;
}

TEST(Collisions, a_bone_in_a_cavity_overlaps_nothing) {
  surface::Surface hollow = box("upper", {0, 0, 0}, {30, 30, 30});
  surface::append(box("cavity", {4, 4, 4}, {22, 22, 22}), hollow);
  const std::vector<surface::Surface> bones = {hollow, box("lower", {5, 5, 5}, {20, 20, 20})};
  const CollisionReport report = follow_moves(bones, {{}, RigidMotion::translation({2, 0, 0})}, {});
  EXPECT_NEAR(report.pairs[0].gap, 1, 1e-9);
  EXPECT_NEAR(report.safe_load, 0.5, 0.03);
}

TEST(Collisions, clamp_shortens_all_moves_alike) {
  scene::Scene scene =
      scene_of(jaws, {RigidMotion::translation({4, 0, 0}), RigidMotion::translation({0, 0, 20})});
  scene.collision = scene::Collision{scene::CollisionMode::clamp, 0.5, 0.01};
  std::vector<std::string> remarks;
  std::vector<std::string> warnings = warnings_of(jaws, scene, remarks);
  const Vec3 lower = scene.moves[1].apply(Vec3::Zero()), upper = scene.moves[0].apply(Vec3::Zero());
  EXPECT_LE(lower.z(), 9.5);
  EXPECT_GE(lower.z(), 9.49 - 1e-3);
  EXPECT_NEAR(upper.x() / 4, lower.z() / 20, 1e-12);
  EXPECT_EQ(remarks.size(), 1u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("all moves end at load 0.47"), std::string::npos) << warnings[0];
}

TEST(Collisions, report_and_none_change_nothing) {
  scene::Scene scene = scene_of(jaws, {{}, RigidMotion::translation({8, 0, 20})});
  std::vector<std::string> remarks;
  std::vector<std::string> warnings = warnings_of(jaws, scene, remarks);
  ASSERT_EQ(warnings.size(), 1u);
  const std::string overlap = "bones 'upper' and 'lower' end 10.0 mm inside one another";
  EXPECT_EQ(warnings[0].find(overlap), 0u) << warnings[0];
  scene.moves[1] = RigidMotion::translation({8, 0, 10.9});
  EXPECT_TRUE(warnings_of(jaws, scene, remarks).empty());
  EXPECT_TRUE(remarks.empty());
  scene.moves[1] = RigidMotion::translation({8, 0, 20});
  scene.collision = scene::Collision{};
  warnings = warnings_of(jaws, scene, remarks);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].find(overlap), 0u) << warnings[0];
  EXPECT_EQ(scene.moves[1].apply(Vec3::Zero()).z(), 20);
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_NE(remarks[0].find("bones 'upper' and 'lower', 10.00 mm apart at the start: come within"),
            std::string::npos)
      << remarks[0];
}

TEST(Collisions, overlapping_bones_are_said_to_lie_deeper) {
  const std::vector<surface::Surface> boxes = {box("upper", {0, 0, 25}, {50, 50, 30}), jaws[1]};
  const scene::Collision requested{scene::CollisionMode::report, 0, 0.05};
  const std::vector<RigidMotion> moves = {{}, RigidMotion::translation({0, 0, 3})};
  const std::string line =
      describe(follow_moves(boxes, moves, requested), scene_of(boxes, moves), requested).at(0);
  EXPECT_NE(line.find("5.00 mm inside one another at the start: touch elsewhere or lie 0.1 mm "
                      "deeper at load 0.03"),
            std::string::npos)
      << line;
}

TEST(Collisions, stop_refuses_the_scene) {
  scene::Scene scene = scene_of(jaws, {{}, RigidMotion::translation({0, 0, 20})});
  scene.collision = scene::Collision{scene::CollisionMode::stop, 0, 0.05};
  std::vector<std::string> remarks;
  try {
    warnings_of(jaws, scene, remarks);
    FAIL() << "accepted";
  } catch (const base::InputError& error) {
    const std::string why = error.what();
    EXPECT_EQ(why.find("plan.yaml: bones 'upper' and 'lower'"), 0u) << why;
    EXPECT_EQ(why.find('\n'), std::string::npos);
  }
  scene.moves[1] = RigidMotion::translation({0, 0, 5});
  warnings_of(jaws, scene, remarks);
}

}  // namespace collision_test
}  // namespace repose::model
