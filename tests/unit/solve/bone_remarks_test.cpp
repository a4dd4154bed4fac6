#include <gtest/gtest.h>

#include "../model/patches.h"
#include "rest.h"
#include "solid_block.h"

/// Columns that bones and instruments enter, and skin that presses on bone.
namespace repose {
namespace bone_remarks_test {

using model::PointSet;

/// A block of 7 × 9 columns, 5 mm apart, of layers 3 mm apart, the skin at z = 0, only one of which
/// is free; a plate of 16 × 16 × 2.8 mm, thinner than a layer, moves from `start`, from above the
/// middle of the block.
solve::Summary move_plate(const Vec3& start, const Vec3& motion, int free = 0) {
  model::Model m = testing::solid_block(7, 9, 4, 0.45, 0, [&](int, int, int a) {
    return a == free ? PointSet::soft_tissue : PointSet::boundary;
  });
  m.bones = {"plate"};
  m.bone_surfaces = {model::patches::box(Vec3(7, 12, 0) + start, Vec3(23, 28, 2.8) + start)};
  m.bone_transform = {scene::RigidMotion::translation(motion).matrix()};
  m.contact.bodies.push_back({"plate", 0});
  m.contact.spacing = 0.25;
  m.contact.stiffness = 0.05;
  testing::add_touching_points(m, 25, false);
  return testing::find_rest(m, testing::settings(1e-3)).summary;
}

/// A plate between the two deepest layers.
solve::PiercedColumns push_plate(double start, double motion) {
  return move_plate({start, 0, -8.9}, {motion, 0, 0}).pierced;
}

TEST(PiercedColumns, APlateBetweenTheDeepestPointsIsFound) {
  const solve::PiercedColumns pierced = push_plate(-60, 60);
  EXPECT_EQ(pierced.columns, 9);
  EXPECT_EQ(pierced.body, 0);
  EXPECT_NEAR(pierced.depth, 1.4 - 0.11, 0.03);  // the grid rounds the ridge of distances
  EXPECT_NEAR(pierced.where.z(), -7.5, 1e-6);
}

TEST(PiercedColumns, ABoneThatCarriesNoPointMovesAlongItsWay) {
  EXPECT_EQ(move_plate({-60, 0, -8.9}, {60, 0, 0}).path.steps, 3);
}

TEST(PiercedColumns, APlateBesideTheBlockOrThereFromTheStartIsNot) {
  EXPECT_EQ(push_plate(-60, 5).columns, 0);
  EXPECT_EQ(push_plate(0, 0.5).columns, 0);
}

/// A block of 7 × 9 columns, 5 mm apart, of four layers 3 mm apart, the skin at z = 0, free but for
/// its rim and its deepest layer. A ball is pushed to `end`, too deep to touch the skin, which
/// alone has contact with it.
solve::Summary push_ball(double radius, const Vec3& end, const Vec3& push) {
  model::Model m = testing::solid_block(7, 9, 4, 0.45, 0, [](int i, int j, int a) {
    const bool free = i > 0 && i < 6 && j > 0 && j < 8 && a < 3;
    return free ? PointSet::soft_tissue : PointSet::boundary;
  });
  m.contact.bodies.push_back({"ball", -1, scene::Sphere{end - push, radius}, push});
  m.contact.stiffness = 0.05;
  testing::add_touching_points(m, 25);
  return testing::find_rest(m, testing::settings(1e-3)).summary;
}

TEST(PiercedByInstrument, ColumnsWithPointsInABallAreNoRestPosition) {
  const solve::Summary summary = push_ball(8, {15, 20, -9}, {60, 0, 0});
  EXPECT_EQ(summary.pierced_by_instrument.columns, 9);
  EXPECT_EQ(summary.pierced_by_instrument.body, 0);
  EXPECT_NEAR(summary.pierced_by_instrument.depth, 8, 1e-9);
  EXPECT_LT((summary.pierced_by_instrument.where - Vec3(15, 20, -9)).norm(), 1e-9);
  EXPECT_EQ(summary.pierced.columns, 0);
  EXPECT_EQ(summary.path.load, 1);
  EXPECT_FALSE(summary.path.complete());
  EXPECT_FALSE(summary.last.converged);
  EXPECT_EQ(summary.last.reason, "columns of tissue pierced by an instrument: 9");
  EXPECT_EQ(summary.path.last.reason, summary.last.reason);
}

TEST(PiercedByInstrument, ABallBetweenTwoLayersIsFound) {
  const solve::PiercedColumns pierced =
      push_ball(0.9, {15, 20, -4.5}, {60, 0, 0}).pierced_by_instrument;
  EXPECT_EQ(pierced.columns, 1);
  EXPECT_NEAR(pierced.depth, 0.9, 0.01);
}

TEST(PiercedByInstrument, ABallBetweenColumnsIsFound) {
  const solve::Summary summary = push_ball(0.9, {18.5, 21.5, -4.5}, {60, 0, 0});
  EXPECT_EQ(summary.pierced_by_instrument.columns, 0);
  EXPECT_EQ(summary.pierced_by_instrument.prisms, 1);
  EXPECT_GT(summary.pierced_by_instrument.depth, 0.45);
  EXPECT_EQ(summary.last.reason, "prisms of tissue pierced by an instrument: 1");
}

// Between four points, which it touches, it reaches 1.7 mm through plane triangles.
TEST(PiercedByInstrument, TissueUnderASmallBallThatPressesTheSkinIsNot) {
  const solve::Summary summary = push_ball(4.5, {17.5, 22.5, 2.5}, {0, 0, -8});
  EXPECT_TRUE(summary.path.complete()) << summary.last.reason;
  EXPECT_EQ(summary.contacts[0].points, 4);
}

TEST(PiercedByInstrument, FixedColumnsAndThoseThatBeganInsideAreNot) {
  EXPECT_EQ(push_ball(8, {0, 20, -9}, {60, 0, 0}).pierced_by_instrument.columns, 3);
  const solve::Summary inside = push_ball(8, {15, 20, -9}, {0.5, 0, 0});
  EXPECT_EQ(inside.pierced_by_instrument.columns, 0);
  EXPECT_TRUE(inside.path.complete());
}

TEST(SkinOnBone, PointsUnderAPlateAreFound) {
  const solve::SkinOnBone found = move_plate({0, 0, 0.5}, {0, 0, -1}).contacts[0].skin;
  EXPECT_EQ(found.points, 9);
  EXPECT_GT(found.pressure, 0);
  EXPECT_NEAR(found.where.z(), -0.5, 0.1);
}

TEST(SkinOnBone, DeepPointsAreNot) {
  const solve::Summary summary = move_plate({0, 0, -12.3}, {0, 0, 1}, 3);
  EXPECT_EQ(summary.contacts[0].points, 9);
  EXPECT_EQ(summary.contacts[0].skin.points, 0);
}

TEST(SkinOnBone, PointsThatABoneComesNearAreNot) {
  EXPECT_EQ(move_plate({0, 0, 0.5}, {0, 0, -0.3}).contacts[0].skin.points, 0);
}

}  // namespace bone_remarks_test
}  // namespace repose
