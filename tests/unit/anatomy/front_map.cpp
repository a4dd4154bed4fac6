#include "anatomy/front_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace repose::anatomy {
namespace {

/// A chin that stands out by 2 mm at z = 6 from a profile that recedes by `slope` downwards.
std::vector<ProfilePoint> chin(double slope) {
  std::vector<ProfilePoint> profile;
  for (double z = 0; z <= 20; z += 0.5)
    profile.emplace_back(-slope * z - 2 * std::exp(-std::pow((z - 6) / 3, 2)), z);
  return profile;
}

TEST(FrontMap, TheChinStandsOutThoughTheProfileRecedesBelowTheTeeth) {
  for (const double slope : {0.0, 0.3, 0.8}) {
    const auto found = chin_of(chin(slope), 0, 18);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->y(), 6, 1.1) << slope;
  }
  EXPECT_FALSE(chin_of(chin(0), 30, 40));
}

/// A chin with two heights that stand out by about 2 mm, the upper one by `more` more.
std::vector<ProfilePoint> two_heights(double more) {
  std::vector<ProfilePoint> profile;
  for (double z = 0; z <= 30; z += 0.5)
    profile.emplace_back(-2 * std::exp(-std::pow((z - 8) / 5, 2)) -
                             (2 + more) * std::exp(-std::pow((z - 18) / 5, 2)),
                         z);
  return profile;
}

TEST(FrontMap, TheChinDoesNotJumpBetweenHeights) {
  const auto lower = chin_of(two_heights(-0.05), 0, 30), upper = chin_of(two_heights(0.05), 0, 30);
  ASSERT_TRUE(lower && upper);
  EXPECT_GT(upper->y(), lower->y());
  EXPECT_LT(upper->y() - lower->y(), 1.5);
}

TEST(FrontMap, TheChinDoesNotJumpWhereItsEndIsForemost) {
  double last = NAN;
  for (double slope = 0; slope <= 0.8; slope += 0.001) {
    const auto found = chin_of(chin(slope), 0, 18);
    ASSERT_TRUE(found);
    if (slope > 0) {
      EXPECT_LT(std::abs(found->y() - last), 0.5) << slope;
    }
    last = found->y();
  }
}

/// A valley that is flat, 8 mm deep, from z = 12 to 19, with one point that is deeper by `pit`.
std::vector<ProfilePoint> valley(double pit_at, double pit) {
  std::vector<ProfilePoint> profile;
  for (double z = 0; z <= 31; z += 0.5)
    profile.emplace_back(8 - 0.7 * std::max({0.0, 12 - z, z - 19}) + (z == pit_at ? pit : 0), z);
  return profile;
}

TEST(FrontMap, OfAFlatValleyTheMiddleIsTaken) {
  for (const double pit_at : {12.0, 15.5, 19.0}) {
    const auto found = farthest_from_chord(valley(pit_at, 0.05), {0, 0}, {0, 31}, -1);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->y(), 15.5, 0.3) << pit_at;
    EXPECT_NEAR(found->x(), 8, 0.06);
  }
  EXPECT_FALSE(farthest_from_chord({}, {0, 0}, {0, 31}, -1));
}

TEST(FrontMap, PointBIsTheDeepestWhereTheProfileIsConcaveAndAtTheUsualHeightWhereNot) {
  const ProfilePoint pogonion(0, 0), edge(-10, 30);
  const auto with_depth = [&](double depth) {
    std::vector<ProfilePoint> profile;
    for (double z = 4; z <= 26; z += 0.5)
      profile.emplace_back(-z / 3 + depth * std::exp(-std::pow((z - 8) / 3, 2)), z);
    return b_point_of(profile, pogonion, edge, 17)->y();
  };
  EXPECT_NEAR(with_depth(3), 8, 0.5);
  EXPECT_NEAR(with_depth(0), 17, 1e-9);
  EXPECT_NEAR(with_depth(-1), 17, 1e-9);
  for (double depth = 0; depth < 2; depth += 0.01)
    EXPECT_LT(std::abs(with_depth(depth + 0.01) - with_depth(depth)), 1) << depth;
  EXPECT_FALSE(b_point_of({}, pogonion, edge, 17));
}

}  // namespace
}  // namespace repose::anatomy
