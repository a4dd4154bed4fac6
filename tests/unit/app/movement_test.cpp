#include "app/movement.h"

#include <gtest/gtest.h>

#include <utility>

namespace repose::app {
namespace {

/// A triangle of the upper and one of the lower lip that share the place of a corner at stomion.
const surface::Surface skin = {
    "",
    {{0, -90, 10}, {4, -90, 10}, {0, -90, -10}, {4, -90, -10}, {1, -90, 0}, {1, -90, 0}},
    {{0, 4, 1}, {2, 3, 5}}};
const scene::Landmarks marks = {{"stomion", {0, -90, 0}}};

const Vec3 up(0, 0, 1);

/// The sentence for points at stomion that move so, with either one first.
std::string after(const Vec3& upper, const Vec3& lower) {
  std::vector<Vec3> moved = skin.points;
  moved[4] += upper;
  moved[5] += lower;
  const std::string text = describe_lips(marks, up, skin, moved);
  surface::Surface lower_first = skin;
  std::swap(lower_first.triangles[0][1], lower_first.triangles[1][2]);
  std::swap(moved[4], moved[5]);
  EXPECT_EQ(describe_lips(marks, up, lower_first, moved), text);
  return text;
}

TEST(LipGap, IsMeasuredUpwards) {
  EXPECT_EQ(after({0, -1, 2.5}, {0, 3, 0}), "Lips 2.5 mm apart at stomion, closed at first. ");
  EXPECT_EQ(after({0, 0, 0}, {0, 0, -1}), "Lips 1.0 mm apart at stomion, closed at first. ");
}

/// The landmarks of lips that hardly move would not show which of the two points is the upper.
TEST(LipGap, ASmallGapAndAnOverlapAreNotConfused) {
  EXPECT_EQ(after({0, 0, 0.125}, {0, 0, 0}), "Lips 0.1 mm apart at stomion, closed at first. ");
  EXPECT_EQ(after({0, 0, -0.125}, {0, 0, 0}), "Lips closed. ");
}

TEST(LipGap, LipsThatSlideAlongEachOtherAreClosed) {
  EXPECT_EQ(after({0, 0, 0}, {0, -4, 0}), "Lips closed. ");
  EXPECT_EQ(after({0, 0, 0}, {0, -4, 0.4}), "Lips closed. ");  // the lower one in front, and above
}

TEST(LipGap, NeedsPartedLipsAndTheirLandmark) {
  EXPECT_EQ(describe_lips({}, up, skin, skin.points), "");
  surface::Surface joined = skin;
  joined.points.pop_back();
  joined.triangles[1][2] = 4;
  EXPECT_EQ(describe_lips(marks, up, joined, joined.points), "");
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
