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
    EXPECT_NEAR(found->y(), 6, 0.6) << slope;
  }
  EXPECT_FALSE(chin_of(chin(0), 30, 40));
}

}  // namespace
}  // namespace repose::anatomy
