#include "repose/linear/newton_estimate.h"

#include <gtest/gtest.h>

#include "solved.h"

namespace repose {
namespace newton_estimate_test {

using testing::Solved;

TEST(NewtonEstimate, IsTheLengthOfTheNewtonStep) {
  Solved s;
  const base::VecHandle at = s.positions.make_vector();
  linear::NewtonEstimate estimate(s.solver);
  EXPECT_EQ(estimate.preconditioned_distance(s.rhs), 0) << "there is no preconditioner yet";
  ASSERT_TRUE(s.solve(at, 1e-12));
  const double length = discrete::largest_block(s.answer);
  EXPECT_NEAR(estimate.distance(at, s.rhs), length, 0.1 * length);
  EXPECT_NEAR(estimate.bound(at, s.rhs, 0), length, 0.05 * length);
  EXPECT_FALSE(estimate.negative_curvature());
  EXPECT_TRUE(estimate.is_minimum(at));
}

TEST(NewtonEstimate, IsRoughBeforeAnySolveWithAKeptPreconditioner) {
  Solved s;
  const base::VecHandle at = s.positions.make_vector();
  const auto kept = s.solver.make_kept(at);
  linear::NewtonEstimate estimate(s.solver);
  const double rough = estimate.preconditioned_distance(s.rhs);
  s.solver.restore(*kept);
  EXPECT_EQ(estimate.preconditioned_distance(s.rhs), rough);
  EXPECT_EQ(s.solver.preconditioner().renewals(), 1);
}

TEST(NewtonEstimate, ContractsToNothingWhereTheGradientVanishes) {
  Solved s;
  const base::VecHandle at = s.positions.make_vector(), none = s.positions.make_vector();
  linear::NewtonEstimate estimate(s.solver);
  estimate.distance(at, s.rhs);
  EXPECT_EQ(estimate.contraction(at, at, none), 0);
  EXPECT_TRUE(std::isinf(estimate.contraction(at, at, s.rhs))) << "the slope has not fallen";
}

}  // namespace newton_estimate_test
}  // namespace repose
