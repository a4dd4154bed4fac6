#include "repose/scene/rigid_motion.h"

#include <gtest/gtest.h>

namespace repose::scene {
namespace landmark_fit_test {

TEST(LandmarkFit, FitsByTheirNumber) {
  const std::vector<Vec3> from{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
      to{{1, 1, 1}, {1, 5, 1}, {-3, 1, 1}};
  for (std::size_t count : {1, 2, 3}) {
    const RigidFit fit =
        fit_landmarks({from.begin(), from.begin() + count}, {to.begin(), to.begin() + count});
    EXPECT_LT(fit.residual, 1e-12) << count;
    EXPECT_LT((fit.motion.apply(from[0]) - to[0]).norm(), 1e-12) << count;
  }
  const RigidFit longer = fit_landmarks({from[0], from[1]}, {to[0], {1, 9, 1}});
  EXPECT_NEAR(longer.residual, 2, 1e-12);
  EXPECT_LT((longer.motion.apply({0, 0, 3}) - Vec3(1, 3, 4)).norm(), 1e-12) << "no turn about it";
  for (const Vec3& to : {Vec3(-4, 0, 0), Vec3(-4, 1e-12, 0), Vec3(4, 0, 0)})
    EXPECT_LT(fit_landmarks({from[0], from[1]}, {from[0], to}).residual, 1e-9) << to.transpose();
}

}  // namespace landmark_fit_test
}  // namespace repose::scene
