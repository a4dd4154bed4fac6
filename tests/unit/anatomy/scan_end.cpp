#include "anatomy/scan_end.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace repose::anatomy {
namespace {

/// A pyramid on a regular polygon of radius 12 mm in z = 0.
surface::Surface pyramid(int64_t corners) {
  surface::Surface result;
  for (int64_t i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / corners;
    result.points.emplace_back(12 * std::cos(angle), 12 * std::sin(angle), 0);
    result.triangles.push_back({i, (i + 1) % corners, corners});
    if (i > 1) result.triangles.push_back({0, i, i - 1});
  }
  result.points.emplace_back(0, 0, 30);
  return result;
}

TEST(ScanEnd, IsAFaceOfManyVertices) {
  EXPECT_TRUE(ScanEnd(pyramid(12)).within({0, 0, 0}, 0.1));
  EXPECT_FALSE(ScanEnd(pyramid(12)).within({0, 0, 30}, 10));
}

TEST(ScanEnd, IsNotALargeTriangleOfADecimatedSurface) {
  EXPECT_FALSE(ScanEnd(pyramid(3)).within({0, 0, 0}, 100));
}

}  // namespace
}  // namespace repose::anatomy
