#include "app/skin_checks.h"

#include <gtest/gtest.h>

#include "../model/patches.h"
#include "repose/scene/rigid_motion.h"

namespace repose::app {
namespace {

/// The row on a skin of two triangles above a box of bone, 1 mm below it, that moves up.
std::string row(double up, const Vec3& low = {4, 4, -8}, const Vec3& high = {16, 16, -1}) {
  surface::Surface skin;
  skin.points = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
  skin.triangles = {{0, 1, 2}, {0, 2, 3}};
  model::Model model;
  model.bones = {"chin"};
  model.bone_surfaces = {model::patches::box(low, high)};
  model.bone_transform = {scene::RigidMotion::translation({0, 0, up}).matrix()};
  model.contact.bodies.push_back({"chin", 0});
  return describe_bone_through_skin(skin, skin.points, model);
}

TEST(BoneThroughSkin, IsReportedBetweenThePointsOfTheSkin) {
  const std::string text = row(2.5);
  EXPECT_NE(text.find("2 triangles"), std::string::npos) << text;
  EXPECT_NE(text.find("1.5 mm inside chin"), std::string::npos) << text;
}

/// Neither the middle of a triangle nor that of an edge lies in it.
TEST(BoneThroughSkin, IsReportedWhereASpikePassesThrough) {
  const std::string text = row(3, {15, 3, -8}, {17, 5, -1});
  EXPECT_NE(text.find("1 triangles"), std::string::npos) << text;
  EXPECT_NE(text.find("0.8 mm inside chin, most at (16.2, 3.8, 0.0)"), std::string::npos) << text;
}

TEST(BoneThroughSkin, IsNotReportedBelowTheSkin) {
  EXPECT_EQ(row(0), "");
  EXPECT_EQ(row(0.9), "");
}

}  // namespace
}  // namespace repose::app
