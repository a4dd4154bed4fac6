#include "repose/solve/initial_hessian.h"

#include <gtest/gtest.h>

namespace repose {
namespace {

/// Iterations until the wear tells to renew, where each leaves `left` of the force of the one
/// before and takes `length` of the full step; 100 where it never does.
int lifetime(solve::StepWear& wear, double left, double length) {
  double force = 1;
  for (int k = 0; k < 100; ++k, force *= left)
    if (wear.take(force, length)) return k;
  return 100;
}

TEST(StepWear, FullStepsAtASteadyRateCostNothing) {
  solve::StepWear wear(12);
  EXPECT_EQ(lifetime(wear, 0.5, 1), 100);
}

TEST(StepWear, WhatLineSearchesCutOffIsSpent) {
  solve::StepWear wear(12);
  EXPECT_EQ(lifetime(wear, 0.5, 0.25), 17);  // the first k with 0.75 k > 12
}

TEST(StepWear, IterationsBeyondThoseOfTheBestRateAreSpent) {
  solve::StepWear wear(12.5);
  double force = 1;
  for (int k = 0; k <= 6; ++k, force *= 0.5) EXPECT_FALSE(wear.take(force, 1));
  for (int k = 0; k <= 12; ++k) EXPECT_FALSE(wear.take(force, 1)) << k;
  EXPECT_TRUE(wear.take(force, 1));
}

TEST(StepWear, ANewOneHasSpentNothing) {
  solve::StepWear wear(12);
  const int first = lifetime(wear, 0.5, 0.25);
  wear.renew();
  EXPECT_EQ(lifetime(wear, 0.5, 0.25), first);
}

}  // namespace
}  // namespace repose
