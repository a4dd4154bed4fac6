#include "model/head_directions.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "patches.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace {

BoneGroup bone(const char* name, const Mat3& turn) {
  BoneGroup group;
  const std::filesystem::path folder = REPOSE_MESHES;
  for (const Vec3& x : surface::read_surface(folder / name).points)
    group.points.push_back(turn * x);
  group.box = surface::bounding_box(group.points);
  return group;
}

TEST(HeadDirections, AClosedSkinLeavesThemToTheBones) {
  const SkinMesh skin = make_skin_mesh(patches::sphere(150, 3));
  const std::array<Vec3, 3> signs = {Vec3(1, 1, 1), Vec3(-1, -1, 1), Vec3(1, -1, -1)};
  for (const Vec3& sign : signs) {
    const Mat3 turn = sign.asDiagonal();
    const auto found =
        head_directions(skin, bone("head_skull.ply", turn), bone("head_mandible.ply", turn));
    ASSERT_TRUE(found);
    EXPECT_LT((found->forward - turn * Vec3(0, -1, 0)).norm(), 1e-12);
    EXPECT_LT((found->up - turn * Vec3(0, 0, 1)).norm(), 1e-12);
    EXPECT_GT(found->facing.dot(found->forward), 0.8);
  }
}

TEST(HeadDirections, ASkullBeforeItsJawLeavesThemOpen) {
  const Mat3 same = Mat3::Identity();
  BoneGroup skull = bone("head_skull.ply", same);
  for (Vec3& x : skull.points) x.y() -= 60;
  skull.box = surface::bounding_box(skull.points);
  EXPECT_FALSE(head_directions(make_skin_mesh(patches::sphere(150, 3)), skull,
                               bone("head_mandible.ply", same)));
}

}  // namespace
}  // namespace repose::model
