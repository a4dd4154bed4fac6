#include "repose/solve/minimizer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "../discrete/moved_block.h"
#include "quadratic.h"
#include "repose/base/options.h"
#include "sum.h"

namespace repose {
namespace minimizer_test {

using base::check;
using testing::Curvatures;
using testing::Curve;
using testing::quartic;
using testing::Sum;

/// A search that begins with every scalar unknown at `start`.
struct Search : testing::MovedBlock {
  Sum sum;
  Curvatures curvatures{sum};
  linear::TangentSolver solver{positions, curvatures};
  base::VecHandle x = positions.make_vector();
  solve::Outcome outcome;

  Search(Curve curve, double start, double accuracy)
      : MovedBlock(testing::resting_block()), sum(positions, curve) {
    check(VecSet(x, start));
    outcome = solve::Minimizer(sum, solver, {}).run(x, accuracy);
  }
};

TEST(Estimate, KnowsHowFarRestIsInAWellFlatAtItsBottom) {
  // Newton steps from x are x/3, 2x/9, …; the second with the first one's Hessian were 8x/81.
  const Search s(quartic, 1, 2);
  EXPECT_TRUE(s.outcome.converged);
  EXPECT_NEAR(s.outcome.displacement_error, discrete::largest_block(s.x), 1e-6);
}

TEST(Estimate, IsNoShorterThanTheWayWhereNoStepWasTaken) {
  const Search s([](double x) { return std::array{x * x / 2, x, 1.0}; }, 2e-7, 1e-6);
  EXPECT_TRUE(s.outcome.converged);
  EXPECT_GT(discrete::largest_block(s.x), 3e-7);
  EXPECT_GE(s.outcome.displacement_error, discrete::largest_block(s.x));
}

TEST(Estimate, AboveTheAccuracyIsNotConverged) {
  const base::ScopedOption few("-tao_max_it", "1");
  const Search s(quartic, 1, 0.1);
  EXPECT_GT(s.outcome.displacement_error, 0.1);
  EXPECT_LT(s.outcome.displacement_error, 1);
  EXPECT_FALSE(s.outcome.converged);
}

TEST(Estimate, IsNotTrustedWhereTheSlopeDoesNotFall) {
  // Newton's step is a quarter of the way, and the next a third as long, by chance; there
  // is no minimum beyond the height of the waves.
  constexpr double height = 1.5;
  const Search s(
      [](double x) {
        constexpr double k = 2 * std::numbers::pi;
        return std::array{x * x / 2 - height / k * std::cos(k * x), x + height * std::sin(k * x),
                          1 + height * k * std::cos(k * x)};
      },
      20.195, 20);
  EXPECT_TRUE(s.outcome.converged);
  EXPECT_GE(s.outcome.displacement_error + std::sqrt(3) * height, discrete::largest_block(s.x));
}

}  // namespace minimizer_test
}  // namespace repose
