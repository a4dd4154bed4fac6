#include "app/skin_checks.h"

#include <gtest/gtest.h>

namespace repose::app {
namespace {

/// 6 × 6 points of skin, 10 mm apart, with a hole of two triangles in the middle and a cut from
/// the border, whose inner point is whole: {2, 5} lies on both of its sides.
surface::Surface skin_with_hole_and_cut() {
  surface::Surface skin;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 6; ++x) skin.points.emplace_back(10 * x, 10 * y, 0);
  skin.points.emplace_back(20, 50, 0);
  for (int64_t y = 0; y < 5; ++y)
    for (int64_t x = 0; x < 5; ++x) {
      const int64_t a = 6 * y + x, b = a + 1, c = a + 7, d = a + 6;
      if (x == 2 && y == 2) continue;
      const int64_t side = x == 2 && y == 4 ? 36 : d;
      skin.triangles.push_back({a, b, c});
      skin.triangles.push_back({a, c, side});
    }
  return skin;
}

std::string row(size_t point, double moved) {
  const surface::Surface skin = skin_with_hole_and_cut();
  std::vector<Vec3> now = skin.points;
  now[point].z() += moved;
  return describe_moving_border(skin, now);
}

TEST(MovingBorder, IsReportedFromAMillimeterOn) {
  EXPECT_NE(row(3, 4.5).find("by 4.5 mm, at (30.0, 0.0, 4.5) mm"), std::string::npos)
      << row(3, 4.5);
  EXPECT_EQ(row(3, 0.9), "");
}

TEST(MovingBorder, IsNeitherInsideNorAHoleNorASideOfACut) {
  for (const size_t point : {8, 14, 32, 36}) EXPECT_EQ(row(point, 4.5), "") << point;
}

}  // namespace
}  // namespace repose::app
