#include "repose/scene/placement.h"

#include <gtest/gtest.h>

#include <limits>

namespace repose::scene {
namespace {

const Vec3 none = Vec3::Zero();

TEST(Placement, TurnsAboutTheCentroidThenTranslates) {
  const Vec3 centroid(10, -40, 5);
  const RigidMotion motion = motion_of({{1, 2, 3}, {0, 0, 90}}, centroid);
  EXPECT_LT((motion.apply(centroid) - (centroid + Vec3(1, 2, 3))).norm(), 1e-12);
  EXPECT_LT((motion.apply(centroid + Vec3(4, 0, 0)) - (centroid + Vec3(1, 6, 3))).norm(), 1e-12);
}

TEST(Placement, IsFoundFromItsMotion) {
  const Vec3 centroid(10, -40, 5);
  for (const Placement& given : {Placement{{1, 2, 3}, {4, -5, 60}}, Placement{{0, 0, 1e-7}, none},
                                 Placement{{-3, 0, 0}, {0, 1e-6, 0}}, Placement{}}) {
    const Placement found = placement_of(motion_of(given, centroid), centroid);
    EXPECT_LT((found.translation - given.translation).norm(), 1e-9);
    EXPECT_LT((found.rotation - given.rotation).norm(), 1e-9);
  }
}

TEST(Placement, IsComparedWithTheBox) {
  const Plan plan{{0}, {8, 4, 2}, {5, 0, 0}};
  EXPECT_EQ(outside_box({{-8, 4, 2}, {5, 0, 0}}, plan), "");
  EXPECT_NE(outside_box({{0, 4.1, 0}, none}, plan).find("4.1 mm along y"), std::string::npos);
  EXPECT_NE(outside_box({none, {0, 0, -1}}, plan).find("-1 degrees along z"), std::string::npos);
  EXPECT_NE(outside_box({{0, 0, std::numeric_limits<double>::quiet_NaN()}, none}, plan), "");
}

}  // namespace
}  // namespace repose::scene
