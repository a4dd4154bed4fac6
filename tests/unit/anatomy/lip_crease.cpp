#include "anatomy/lip_crease.h"

#include <gtest/gtest.h>

#include "repose/anatomy/propose.h"

namespace repose::anatomy {
namespace {

/// Adds a rectangle in the frontal plane at a depth.
void add(surface::Surface& skin, double y, const Eigen::Vector2d& low,
         const Eigen::Vector2d& high) {
  const auto first = static_cast<int64_t>(skin.points.size());
  for (const double x : {low.x(), high.x()})
    for (const double z : {low.y(), high.y()}) skin.points.emplace_back(x, y, z);
  skin.triangles.push_back({first, first + 1, first + 2});
  skin.triangles.push_back({first + 1, first + 3, first + 2});
}

/// A face whose lips touch along a crease that bends, `shift` above the origin.
surface::Surface curved_face(double shift) {
  constexpr int half = 40;
  surface::Surface skin;
  for (int x = -half; x <= half; ++x)
    for (int z = -half; z <= half; ++z) {
      const double from_crease = z + 3 - 2 * std::cos(0.13 * x + 0.2);
      skin.points.emplace_back(x, 0.01 * x * x + 3 * std::exp(-from_crease * from_crease / 60),
                               z + shift);
    }
  constexpr int64_t row = 2 * half + 1;
  for (int64_t x = 0; x + 1 < row; ++x)
    for (int64_t z = 0; z + 1 < row; ++z) {
      const int64_t first = x * row + z;
      skin.triangles.push_back({first, first + row, first + 1});
      skin.triangles.push_back({first + 1, first + row, first + row + 1});
    }
  return skin;
}

/// A face with an open mouth 40 mm wide: the gap is from −12 to −3 mm, the lower lip lies 8 mm
/// behind the upper one, and the back of the head is seen through the gap.
surface::Surface open_face() {
  surface::Surface skin;
  add(skin, 0, {-50, -3}, {50, 40});
  add(skin, 8, {-50, -60}, {50, -12});
  add(skin, 0, {-50, -12}, {-20, -3});
  add(skin, 0, {20, -12}, {50, -3});
  add(skin, 150, {-50, -60}, {50, 40});
  return skin;
}

TEST(LipCrease, AHoleInALipIsClosedAndAnOpenMouthIsNot) {
  const auto hole_of = [](double half_width) {
    surface::Surface skin = curved_face(0);
    std::erase_if(skin.triangles, [&](const Triangle& t) {
      const Vec3& p = skin.points[t[0]];
      return std::abs(p.x()) <= half_width && std::abs(p.z() - 4) <= 2;
    });
    add(skin, 150, {-40, -40}, {40, 40});
    return FrontMap(skin, HeadFrame{});
  };
  const FrontMap closed = hole_of(3), open = hole_of(15);
  EXPECT_FALSE(open_mouth(closed, 1));
  EXPECT_NEAR(*closed.depth(0.2, 4.2), 1, 1);
  EXPECT_TRUE(open_mouth(open, 1));
  EXPECT_NEAR(*open.depth(0.2, 4.2), 150, 1e-9);
}

TEST(LipCrease, OpenLipsAreThoseOfTheGapAndNotWhatIsSeenThroughIt) {
  const FrontMap map(open_face(), HeadFrame{});
  const auto gap = open_mouth(map, 1);
  ASSERT_TRUE(gap);
  EXPECT_NEAR(*gap, -7.5, 0.5);
  const LipCrease crease = follow_crease(map, *gap, {}, {});
  EXPECT_TRUE(crease.open);
  EXPECT_NEAR(crease.gap, 9, 1);
  ASSERT_GT(crease.points.size(), 10u);
  EXPECT_NEAR(crease.points.front().x(), -20, 1);
  EXPECT_NEAR(crease.points.back().x(), 20, 1);
  for (const Vec3& point : crease.points) EXPECT_NEAR(point.y(), 0, 0.1);
}

TEST(LipCrease, AWireInTheMidlineClosesNoMouth) {
  surface::Surface skin = open_face();
  add(skin, 2, {-1, -12}, {1, -3});
  const FrontMap map(skin, HeadFrame{});
  const auto gap = open_mouth(map, 1);
  ASSERT_TRUE(gap);
  const LipCrease crease = follow_crease(map, *gap, {}, {});
  EXPECT_TRUE(crease.open);
  EXPECT_NEAR(crease.points.front().x(), -20, 1);
  EXPECT_NEAR(crease.points.back().x(), 20, 1);
  for (size_t i = 1; i < crease.points.size(); ++i)
    EXPECT_GT(crease.points[i].x(), crease.points[i - 1].x());
}

TEST(LipCrease, AGapThatIsLostOnOneSideIsFollowedAsFarAsOnTheOther) {
  surface::Surface skin;
  add(skin, 0, {-50, -3}, {50, 40});
  add(skin, 8, {-50, -60}, {50, -24});
  add(skin, 8, {-50, -24}, {5, -12});  // beyond 5 mm the gap is 12 mm wider at once
  add(skin, 0, {-50, -12}, {-20, -3});
  add(skin, 150, {-50, -60}, {5, 40});
  const FrontMap map(skin, HeadFrame{});
  const LipCrease crease = follow_crease(map, *open_mouth(map, 1), {}, {});
  ASSERT_TRUE(crease.lost);
  EXPECT_NEAR((*crease.lost)[1], 5, 1);
  EXPECT_NEAR(crease.points.front().x(), -20, 1);
  EXPECT_NEAR(crease.points.back().x(), 20, 1);
}

TEST(LipCrease, ASideOnWhichItIsLostIsFollowedAsFarAsTheOther) {
  surface::Surface skin;
  add(skin, 0, {-50, -2}, {50, 40});
  add(skin, 0, {-50, -60}, {50, -4});
  add(skin, 3, {-5, -4}, {24, -2});
  add(skin, 0, {-50, -4}, {-5, -2});
  add(skin, 0, {24, -4}, {50, -2});
  const FrontMap map(skin, HeadFrame{});
  const LipCrease crease = follow_crease(map, -3, {}, {});
  ASSERT_TRUE(crease.lost);
  EXPECT_NEAR((*crease.lost)[0], 5, 1);
  EXPECT_NEAR((*crease.lost)[1], 24, 1);
  EXPECT_NEAR(crease.points.front().x(), -crease.points.back().x(), 1);
  EXPECT_FALSE(follow_crease(map, -3, Vec3(-20, 0, -3), Vec3(20, 0, -3)).lost);
}

TEST(LipCrease, AMirroredFaceHasAMirroredPath) {
  surface::Surface skin;
  add(skin, 0, {-50, -2}, {50, 40});
  add(skin, 0, {-50, -60}, {50, -4});
  add(skin, 3, {-50, -4}, {50, -2});
  const auto path = [&](double right, double left) {
    return find_lip_crease(skin, HeadFrame{},
                           {{"mouth_right", {right, 0, -3}}, {"mouth_left", {left, 0, -3}}});
  };
  const std::vector<Vec3> there = path(-23.2, 21.7), mirrored = path(-21.7, 23.2);
  ASSERT_GT(there.size(), 20u);
  ASSERT_EQ(there.size(), mirrored.size());
  for (size_t i = 0; i < there.size(); ++i)
    EXPECT_NEAR(there[i].x(), -mirrored[there.size() - 1 - i].x(), 1e-9);
}

TEST(LipCrease, MovesWithTheFace) {
  const auto path = [](double shift) {
    const Vec3 right(-24, 5.8, shift - 3.3), left(24, 5.8, shift - 5);
    return find_lip_crease(curved_face(shift), HeadFrame{},
                           {{"mouth_right", right}, {"mouth_left", left}});
  };
  const std::vector<Vec3> there = path(0);
  ASSERT_GT(there.size(), 20u);
  for (int k = 1; k <= 40; ++k) {
    const std::vector<Vec3> moved = path(7.3 * k);
    ASSERT_EQ(moved.size(), there.size());
    for (size_t i = 0; i < there.size(); ++i)
      EXPECT_NEAR((moved[i] - there[i]).z(), 7.3 * k, 1e-6) << "point " << i;
  }
}

TEST(LipCrease, ASideThatRunsOnEndsWhereACornerOfTheMouthCanBe) {
  for (const double left : {24.0, 48.0}) {
    surface::Surface skin;
    add(skin, 0, {-60, -2}, {60, 40});
    add(skin, 0, {-60, -60}, {60, -4});
    add(skin, 3, {-60, -4}, {left, -2});
    add(skin, 0, {left, -4}, {60, -2});
    const LipCrease crease = follow_crease(FrontMap(skin, HeadFrame{}), -3, {}, {});
    ASSERT_TRUE(crease.lost);
    EXPECT_NEAR((*crease.lost)[0], 45, 1);
    EXPECT_NEAR(crease.points.front().x(), left < 34 ? -24 : -25, 1);
    EXPECT_NEAR(crease.points.back().x(), left < 34 ? 24 : 25, 1);
  }
}

TEST(LipCrease, KnownCornersLeadWhereThereIsNoCrease) {
  surface::Surface skin;
  add(skin, 0, {-50, -60}, {50, 40});
  const Vec3 right(-24, 0, -8), left(26, 0, 2);
  const LipCrease crease = follow_crease(FrontMap(skin, HeadFrame{}), -3, right, left);
  ASSERT_FALSE(crease.points.empty());
  EXPECT_LT((crease.points.front() - right).norm(), 2);
  EXPECT_LT((crease.points.back() - left).norm(), 2);
}

TEST(LipCrease, OpenLipsThatTouchAtTheSidesEndAtTheCornersOfTheirCrease) {
  surface::Surface skin;
  add(skin, 0, {-50, -3}, {50, 40});
  add(skin, 0, {-50, -60}, {50, -12});
  for (const int side : {-1, 1}) {
    const auto strip = [&](double y, double from, double to, double low, double high) {
      add(skin, y, {std::min(side * from, side * to), low},
          {std::max(side * from, side * to), high});
    };
    strip(0, 6, 50, -12, -8.5);
    strip(0, 6, 50, -6.5, -3);
    strip(4, 6, 25, -8.5, -6.5);
    strip(0, 25, 50, -8.5, -6.5);
  }
  add(skin, 150, {-50, -60}, {50, 40});
  const LipCrease crease = follow_crease(FrontMap(skin, HeadFrame{}), -7.5, {}, {});
  EXPECT_TRUE(crease.open);
  EXPECT_NEAR(crease.gap, 9, 1);
  ASSERT_GT(crease.points.size(), 10u);
  EXPECT_NEAR(crease.points.front().x(), -25, 1);
  EXPECT_NEAR(crease.points.back().x(), 25, 1);
}

TEST(LipCrease, ALowerLipFarBehindTheUpperOneIsNoOpenMouth) {
  surface::Surface skin;
  add(skin, 0, {-50, -3}, {50, 40});
  add(skin, 4, {-50, -60}, {50, -22});
  for (int row = 0; row < 18; ++row)
    add(skin, 12 - row / 2.25, {-50, -5.0 - row}, {50, -4.0 - row});
  add(skin, 14, {-50, -4}, {50, -3});
  const FrontMap map(skin, HeadFrame{});
  EXPECT_FALSE(open_mouth(map, -3));
  const LipCrease crease = follow_crease(map, -3, Vec3(-20, 0, -3), Vec3(20, 0, -3));
  EXPECT_FALSE(crease.open);
  ASSERT_FALSE(crease.points.empty());
  EXPECT_NEAR(crease.points.front().x(), -20, 1);
  EXPECT_NEAR(crease.points.back().x(), 20, 1);
}

}  // namespace
}  // namespace repose::anatomy
