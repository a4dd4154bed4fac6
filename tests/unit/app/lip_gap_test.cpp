#include "app/lip_gap.h"

#include <gtest/gtest.h>

namespace repose::app {
namespace {

/// Skin points of the upper and the lower lip, and two at stomion, of which the first is the
/// upper's.
const std::vector<Vec3> skin = {{0, -90, 10}, {0, -90, -10}, {1, -90, 0}, {1, -90, 0}};
const scene::Landmarks marks = {
    {"upper_lip", {0, -90, 10}}, {"lower_lip", {0, -90, -10}}, {"stomion", {0, -90, 0}}};

std::string after(const Vec3& upper, const Vec3& lower) {
  std::vector<Vec3> moved = skin;
  for (const size_t i : {0, 2}) moved[i] += upper;
  for (const size_t i : {1, 3}) moved[i] += lower;
  return describe_lips(marks, skin, moved);
}

TEST(LipGap, IsMeasuredAlongZ) {
  EXPECT_EQ(after({0, -1, 2.5}, {0, 3, 0}), "Lips 2.5 mm apart at stomion, together before. ");
  EXPECT_EQ(after({0, 0, 0}, {0, 0, -1}), "Lips 1.0 mm apart at stomion, together before. ");
}

TEST(LipGap, LipsThatSlideAlongEachOtherAreClosed) {
  EXPECT_EQ(after({0, 0, 0}, {0, -4, 0}), "Lips closed. ");
  EXPECT_EQ(after({0, 0, 0}, {0, -4, 0.4}), "Lips closed. ");  // the lower one in front, and above
}

TEST(LipGap, NeedsPartedLipsAndTheirLandmarks) {
  EXPECT_EQ(describe_lips({}, skin, skin), "");
  EXPECT_EQ(describe_lips(marks, {skin[0], skin[1], skin[2]}, {skin[0], skin[1], skin[2]}), "");
}

}  // namespace
}  // namespace repose::app
