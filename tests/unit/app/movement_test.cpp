#include "app/movement.h"

#include <gtest/gtest.h>

#include <utility>

namespace repose::app {
namespace {

/// Skin points of the upper and the lower lip, and two at stomion, of which the first is the
/// upper's.
const std::vector<Vec3> skin = {{0, -90, 10}, {0, -90, -10}, {1, -90, 0}, {1, -90, 0}};
const scene::Landmarks marks = {
    {"upper_lip", {0, -90, 10}}, {"lower_lip", {0, -90, -10}}, {"stomion", {0, -90, 0}}};

const Vec3 up(0, 0, 1);

/// The sentence for lips that move so, with either one's point at stomion first.
std::string after(const Vec3& upper, const Vec3& lower) {
  const std::vector<Vec3> upper_first = {skin[0] + upper, skin[1] + lower, skin[2] + upper,
                                         skin[3] + lower};
  std::vector<Vec3> lower_first = upper_first;
  std::swap(lower_first[2], lower_first[3]);
  const std::string text = describe_lips(marks, up, skin, upper_first);
  EXPECT_EQ(describe_lips(marks, up, skin, lower_first), text);
  return text;
}

TEST(LipGap, IsMeasuredUpwards) {
  EXPECT_EQ(after({0, -1, 2.5}, {0, 3, 0}), "Lips 2.5 mm apart at stomion, together before. ");
  EXPECT_EQ(after({0, 0, 0}, {0, 0, -1}), "Lips 1.0 mm apart at stomion, together before. ");
}

TEST(LipGap, LipsThatSlideAlongEachOtherAreClosed) {
  EXPECT_EQ(after({0, 0, 0}, {0, -4, 0}), "Lips closed. ");
  EXPECT_EQ(after({0, 0, 0}, {0, -4, 0.4}), "Lips closed. ");  // the lower one in front, and above
}

TEST(LipGap, NeedsPartedLipsAndTheirLandmarks) {
  EXPECT_EQ(describe_lips({}, up, skin, skin), "");
  EXPECT_EQ(describe_lips(marks, up, {skin[0], skin[1], skin[2]}, {skin[0], skin[1], skin[2]}), "");
}

/// A place in the middle of an edge between a vertex that moves and one that does not.
TEST(Movement, OfAPlaceIsLinearBetweenVertices) {
  const surface::Surface triangle{"", {{0, 0, 0}, {4, 0, 0}, {0, 0, 4}}, {{0, 1, 2}}};
  const std::vector<Vec3> moved = {{0, 0, 0}, {4, -6, 0}, {0, 0, 4}};
  const std::string text =
      describe_movement({{"chin", {2, 1, 0}}}, Mat3::Identity(), triangle, moved);
  EXPECT_TRUE(text.starts_with("Chin 3.0 mm forward; largest movement 6.0 mm")) << text;
}

/// A movement that is less than the sentence's last digit is stated as such.
TEST(Movement, OfLessThanATenthOfAMillimeterIsStated) {
  const surface::Surface triangle{"", {{0, 0, 0}, {4, 0, 0}, {0, 0, 4}}, {{0, 1, 2}}};
  const auto moved_by = [&](double mm) {
    return describe_movement({}, Mat3::Identity(), triangle, {{0, 0, 0}, {4, -mm, 0}, {0, 0, 4}});
  };
  EXPECT_EQ(moved_by(0), "The face does not move.");
  EXPECT_EQ(moved_by(0.05), "The face moves 0.05 mm at most.");
}

TEST(Movement, WithoutASkinIsNotCalledNone) {
  EXPECT_EQ(describe_movement({}, Mat3::Identity(), {}, {}),
            "The model has no skin/points; point/displacement states movements.");
}

}  // namespace
}  // namespace repose::app
