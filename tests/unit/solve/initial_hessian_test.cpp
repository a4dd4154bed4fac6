#include "solve/initial_hessian.h"

#include <gtest/gtest.h>

namespace repose {
namespace initial_hessian_test {

/// Iterations until the lag tells to renew, where each leaves `left` of the force of the one
/// before and takes `length` of the full step; 100 where it never does.
int lifetime(solve::StepLag& lag, double left, double length) {
  double force = 1;
  for (int k = 0; k < 100; ++k, force *= left)
    if (lag.observe(force, length)) return k;
  return 100;
}

TEST(StepLag, FullStepsAtASteadyRateCostNothing) {
  solve::StepLag lag(12);
  EXPECT_EQ(lifetime(lag, 0.5, 1), 100);
}

TEST(StepLag, WhatLineSearchesCutOffIsSpent) {
  solve::StepLag lag(12);
  EXPECT_EQ(lifetime(lag, 0.5, 0.25), 17);  // the first k with 0.75 k > 12
}

TEST(StepLag, IterationsBeyondThoseOfTheBestRateAreSpent) {
  solve::StepLag lag(12.5);
  double force = 1;
  for (int k = 0; k <= 6; ++k, force *= 0.5) EXPECT_FALSE(lag.observe(force, 1));
  for (int k = 0; k <= 12; ++k) EXPECT_FALSE(lag.observe(force, 1)) << k;
  EXPECT_TRUE(lag.observe(force, 1));
}

TEST(StepLag, ANewOneHasSpentNothing) {
  solve::StepLag lag(12);
  const int first = lifetime(lag, 0.5, 0.25);
  lag.renew();
  EXPECT_EQ(lifetime(lag, 0.5, 0.25), first);
}

}  // namespace initial_hessian_test
}  // namespace repose
