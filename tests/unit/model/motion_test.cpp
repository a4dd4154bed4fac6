#include "repose/model/motion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "repose/base/error.h"

namespace repose::model {
namespace motion_test {

const scene::RigidMotion screw =
    scene::RigidMotion::translation({1, 6, -2})
        .after(scene::RigidMotion::rotation({1, 2, 0}, {5, 10, 20}, 40));

const std::vector<Vec3> cloud{{0, 0, 0}, {30, 1, 0}, {2, 40, 5}, {-3, 7, 25}, {11, -13, 17}};

void add_point(Model& model, PointSet set, int32_t bone, const Vec3& from, const Vec3& to) {
  model.points.position.push_back(from);
  model.points.target.push_back(to);
  model.points.set.push_back(set);
  model.points.bone.push_back(bone);
}

/// One bone whose points go to the given places, and no transform.
Model with_targets(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  Model model;
  model.bones = {"mandible"};
  for (std::size_t i = 0; i < from.size(); ++i) add_point(model, PointSet::bone, 0, from[i], to[i]);
  return model;
}

std::vector<Vec3> moved(const std::vector<Vec3>& points) {
  std::vector<Vec3> result;
  for (const Vec3& p : points) result.push_back(screw.apply(p));
  return result;
}

void expect_straight(const Model& model) {
  const PrescribedMotion motion(model);
  for (std::size_t i = 0; i < model.points.position.size(); ++i) {
    const Vec3 &from = model.points.position[i], &to = model.points.target[i];
    EXPECT_LT((motion.at(model, i, 0.25) - (0.75 * from + 0.25 * to)).norm(), 1e-13);
    EXPECT_EQ(motion.at(model, i, 0), from);
    EXPECT_EQ(motion.at(model, i, 1), to);
  }
  EXPECT_EQ(motion.bone_matrix(0, 0.5), Mat4::Identity());
}

TEST(PrescribedMotion, FollowsTheTransformOfTheBone) {
  Model model = with_targets(cloud, moved(cloud));
  model.bone_transform = {screw.matrix()};
  const PrescribedMotion motion(model);
  EXPECT_EQ(motion.bone_matrix(0, 1), screw.matrix()) << "load 1 is the transform itself";
  EXPECT_EQ(motion.bone_matrix(0, 0.3), screw.matrix(0.3));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(motion.at(model, i, 0), cloud[i]);
    EXPECT_EQ(motion.at(model, i, 0.3), screw.apply(cloud[i], 0.3));
    EXPECT_EQ(motion.at(model, i, 1), screw.apply(cloud[i]));
  }
}

TEST(PrescribedMotion, IsRecoveredFromTargets) {
  const Model model = with_targets(cloud, moved(cloud));
  const PrescribedMotion motion(model);
  for (double load : {0.0, 0.1, 0.5, 1.0})
    EXPECT_LT((motion.bone_matrix(0, load) - screw.matrix(load)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((motion.at(model, 2, 0.5) - screw.apply(cloud[2], 0.5)).norm(), 1e-12);
}

TEST(PrescribedMotion, IsStraightWhereTargetsAreNotRigid) {
  std::vector<Vec3> to = moved(cloud);
  to[3] += Vec3(1e-5, 0, 0);
  expect_straight(with_targets(cloud, to));
}

TEST(PrescribedMotion, IsStraightForTooFewPointsOrALine) {
  const std::vector<Vec3> two(cloud.begin(), cloud.begin() + 2);
  expect_straight(with_targets(two, moved(two)));
  const std::vector<Vec3> line{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {7, 7, 7}};
  expect_straight(with_targets(line, moved(line)));
}

TEST(PrescribedMotion, BonesAreIndependent) {
  Model model = with_targets(cloud, moved(cloud));
  model.bones.push_back("chin");
  for (const Vec3& p : cloud) add_point(model, PointSet::bone, 1, p, p + Vec3(0, 4, 0));
  model.bones.push_back("carries nothing");
  const PrescribedMotion motion(model);
  const int64_t chin = static_cast<int64_t>(cloud.size());
  EXPECT_LT((motion.at(model, 0, 0.5) - screw.apply(cloud[0], 0.5)).norm(), 1e-12);
  EXPECT_LT((motion.at(model, chin, 0.5) - cloud[0] - Vec3(0, 2, 0)).norm(), 1e-12);
  EXPECT_EQ(motion.bone_matrix(2, 0.5), Mat4::Identity());
}

TEST(PrescribedMotion, OtherPointsStayOrGoStraight) {
  Model model;
  const Vec3 from(0.1, 0.2, 0.3), to(7.7, -2.2, 1.1);
  for (PointSet set : {PointSet::soft_tissue, PointSet::boundary, PointSet::held})
    add_point(model, set, -1, from, to);
  const PrescribedMotion motion(model);
  EXPECT_EQ(motion.at(model, 0, 1), from);
  EXPECT_EQ(motion.at(model, 1, 1), from);
  EXPECT_EQ(motion.at(model, 2, 1), to);
  EXPECT_LT((motion.at(model, 2, 0.5) - 0.5 * (from + to)).norm(), 1e-15);
}

// A point at distance r from the axis of a turn by θ travels the arc r θ; 16 chords of it are
// r · 32 sin(θ / 32).
TEST(PrescribedMotion, LargestTravelIsAlongTheArc) {
  using Beside = PrescribedMotion::Beside;
  Model model =
      with_targets({{10, 0, 0}, {20, 0, 0}, {0, 5, 3}}, {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}});
  model.bone_transform = {scene::RigidMotion::rotation({0, 0, 1}, {0, 0, 0}, 180).matrix()};
  EXPECT_NEAR(PrescribedMotion(model).largest_travel(model),
              20 * 32 * std::sin(std::numbers::pi / 32), 1e-10);
  add_point(model, PointSet::held, -1, {0, 0, 0}, {0, 100, 0});
  EXPECT_NEAR(PrescribedMotion(model).largest_travel(model), 100, 1e-12);
  add_point(model, PointSet::soft_tissue, -1, {40, 0, 0}, {0, 500, 0});
  EXPECT_NEAR(PrescribedMotion(model).largest_travel(model), 100, 1e-12);
  EXPECT_NEAR(PrescribedMotion(model).largest_travel(model, std::array{Beside{0, 4}}),
              40 * 32 * std::sin(std::numbers::pi / 32), 1e-10);
}

TEST(PrescribedMotion, NothingPrescribedTravelsNowhere) {
  const Model model;
  EXPECT_EQ(PrescribedMotion(model).largest_travel(model), 0);
}

TEST(PrescribedMotion, RefusesATransformThatIsNotRigid) {
  Model model = with_targets(cloud, cloud);
  model.bone_transform = {2 * Mat4::Identity()};
  model.bone_transform[0](3, 3) = 1;
  try {
    PrescribedMotion motion(model);
    FAIL() << "accepted";
  } catch (const base::InputError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("bone_transform of bone 'mandible': the matrix is not rigid"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace motion_test
}  // namespace repose::model
