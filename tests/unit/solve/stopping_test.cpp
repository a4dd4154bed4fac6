#include "solve/stopping_test.h"

#include <gtest/gtest.h>

#include "../discrete/moved_block.h"
#include "quadratic.h"
#include "solve/newton_finish.h"
#include "sum.h"

/// The parts of a minimizer alone, on sums of one curve of every scalar unknown.
namespace repose::solve {
namespace stopping_test {

using Criterion = StoppingTest::Criterion;

struct Parts : testing::MovedBlock {
  testing::Sum sum;
  testing::Curvatures curvatures{sum};
  linear::TangentSolver solver{positions, curvatures};
  RestDistance distance{sum, {sum, solver}};
  base::VecHandle x = positions.make_vector(), gradient = positions.make_vector();

  explicit Parts(testing::Curve curve =
                     [](double x) {
                       return std::array{x * x / 2, x, 1.0};
                     })
      : MovedBlock(testing::resting_block()), sum(positions, curve) {}

  RestDistance::State at(double place, bool last = false) {
    base::check(VecSet(x, place));
    sum.evaluate(x, gradient);
    return {x, gradient, last};
  }
  NewtonFinish::End finish_from(double place) {
    NewtonFinish finish(sum, distance);
    at(place);
    return finish.run(x, 0.01, 0, true);
  }
  /// Returns whether a test ends the search at a place.
  bool ends(StoppingTest& test, double place) {
    at(place);
    return test.ends({x, gradient, discrete::largest_block(gradient)});
  }
};

double distance(double place) { return std::sqrt(3) * place; }

TEST(RestDistance, IsTwoNewtonStepsInAParabola) {
  Parts parts;
  EXPECT_NEAR(parts.distance.estimate(parts.at(0.5, true), 0.01), 2 * distance(0.5), 1e-6);
}

TEST(RestDistance, IsZeroWhereNoForceIsLeftAndInfiniteAtASaddle) {
  Parts parts;
  EXPECT_EQ(parts.distance.estimate(parts.at(0), 0.01), 0);
  Parts saddle([](double x) { return std::array{-x * x / 2, -x, -1.0}; });
  EXPECT_TRUE(std::isinf(saddle.distance.estimate(saddle.at(0), 0.01)));
}

TEST(RestDistance, GrowsByTheContractionWhereTheWellIsFlat) {
  // Newton's step of x⁴ is a third of the way, the next two thirds as long.
  Parts parts(testing::quartic);
  EXPECT_NEAR(parts.distance.estimate(parts.at(0.1, true), 1), distance(0.1), 1e-6);
}

TEST(StoppingTest, EndsWithinTheAccuracyAndNotBefore) {
  Parts parts;
  StoppingTest test(parts.sum, parts.distance, Method::newton, false);
  test.begin(0.1, Criterion::distance, true);
  EXPECT_FALSE(parts.ends(test, 1));
  EXPECT_NEAR(test.error(), 2 * distance(1), 1e-6);
  EXPECT_TRUE(parts.ends(test, 0.02));
  EXPECT_FALSE(test.left_to_finish());
}

TEST(StoppingTest, MakesNoEstimateWhereTheForceSaysThatRestIsFar) {
  constexpr int seldom = 20;  // evaluations from one estimate to the next at least
  Parts parts;
  StoppingTest test(parts.sum, parts.distance, Method::gradient, false);
  test.begin(1e-3, Criterion::distance, true);
  EXPECT_FALSE(parts.ends(test, 1));
  for (int n = 0; n < seldom; ++n) parts.at(0.9);
  const int64_t assemblies = parts.curvatures.assemblies();
  EXPECT_FALSE(parts.ends(test, 0.9));
  EXPECT_EQ(parts.curvatures.assemblies(), assemblies);
  EXPECT_NEAR(test.error(), 2 * distance(0.9), 1e-6);
  EXPECT_TRUE(parts.ends(test, 2e-4));
  EXPECT_GT(parts.curvatures.assemblies(), assemblies);
}

TEST(StoppingTest, LeavesTheRestToNewtonStepsWhereTheyMayFinish) {
  Parts parts;
  StoppingTest test(parts.sum, parts.distance, Method::gradient, true);
  test.begin(0.1, Criterion::distance, true);
  EXPECT_TRUE(parts.ends(test, 0.1));
  EXPECT_TRUE(test.left_to_finish());
  test.begin(0.1, Criterion::distance, false);
  EXPECT_FALSE(parts.ends(test, 0.1));
  EXPECT_FALSE(test.left_to_finish());
}

TEST(StoppingTest, GoesOnWithAccuracyZeroUntilNoForceIsLeft) {
  Parts parts;
  StoppingTest test(parts.sum, parts.distance, Method::newton, false);
  test.begin(0, Criterion::distance, true);
  EXPECT_FALSE(parts.ends(test, 1e-12));
  EXPECT_TRUE(parts.ends(test, 0));
}

TEST(NewtonFinish, GoesToTheBottomOfAParabolaInOneStep) {
  Parts parts;
  const NewtonFinish::End end = parts.finish_from(0.02);
  EXPECT_EQ(end.corrections, 1);
  EXPECT_LE(end.error, 0.01);
  EXPECT_NEAR(discrete::largest_block(parts.x), 0, 1e-4);
  EXPECT_NEAR(end.objective, 0, 1e-6);
}

TEST(NewtonFinish, LeavesAStateThatIsFar) {
  Parts parts;
  const NewtonFinish::End end = parts.finish_from(5);
  EXPECT_EQ(end.corrections, 0);
  EXPECT_NEAR(end.error, 2 * distance(5), 1e-4);
  EXPECT_NEAR(discrete::largest_block(parts.x), distance(5), 1e-12);
}

TEST(NewtonFinish, TakesAStepBackThatLeadsFartherAway) {
  // Newton's step of |x|^(4/3) is three times the way to rest.
  Parts parts([](double x) {
    const double root = std::cbrt(x);
    return std::array{0.75 * x * root, root, 1 / (3 * root * root)};
  });
  const NewtonFinish::End end = parts.finish_from(0.005);
  EXPECT_EQ(end.corrections, 0);
  EXPECT_NEAR(discrete::largest_block(parts.x), distance(0.005), 1e-12);
}

}  // namespace stopping_test
}  // namespace repose::solve
