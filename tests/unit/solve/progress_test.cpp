#include "solve/progress_test.h"

#include <gtest/gtest.h>

#include <cmath>

namespace repose::solve {
namespace progress_test {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Evaluations after which a search stalls whose k-th evaluation has these numbers; 0: never.
template <class At>
int64_t stalls_at(At&& at) {
  ProgressTest test;
  for (int64_t k = 1; k <= 10000; ++k) {
    ProgressTest::State state = at(static_cast<double>(k));
    state.evaluations = k;
    if (test.ends(state)) return k;
  }
  return 0;
}

TEST(ProgressTest, EndsWithin500EvaluationsWhereNothingFalls) {
  const int64_t at = stalls_at([](double k) {
    return ProgressTest::State{0, 50, 1 + 0.5 * std::sin(k), infinity};
  });
  EXPECT_GT(at, 0);
  EXPECT_LE(at, 500);
}

TEST(ProgressTest, EndsWhereTheObjectiveCreeps) {
  const auto creeping = [](double k) {
    return ProgressTest::State{0, 100 / (1 + k) + 50 - 1e-9 * k, 1, 3};
  };
  EXPECT_GT(stalls_at(creeping), 0);
  EXPECT_LE(stalls_at(creeping), 500);
}

TEST(ProgressTest, WaitsForWhatFallsSlowly) {
  const auto slowly = [](double k) { return std::exp(-1e-3 * k); };
  const auto lower = [](double k) { return ProgressTest::State{0, -std::exp(5e-4 * k), 1, 1}; };
  EXPECT_EQ(stalls_at(lower), 0);
  EXPECT_EQ(stalls_at([&](double k) { return ProgressTest::State{0, 1, slowly(k), infinity}; }), 0);
  EXPECT_EQ(stalls_at([&](double k) { return ProgressTest::State{0, 1, 1, slowly(k)}; }), 0);
}

TEST(ProgressTest, CountsTheEvaluationsOfItsOwnSearch) {
  ProgressTest test;
  EXPECT_FALSE(test.ends({1000, 1, 1, 1}));
  EXPECT_FALSE(test.ends({1000 + ProgressTest::patience - 1, 1, 1, 1}));
  EXPECT_TRUE(test.ends({1000 + ProgressTest::patience, 1, 1, 1}));
  test.begin();
  EXPECT_FALSE(test.stalled());
  EXPECT_FALSE(test.ends({5000, 2, 2, 2}));
}

TEST(ProgressTest, EndsAtRoundingAfterTwentyIterationsThatLowerNothing) {
  ProgressTest test(false);
  const auto at = [](int64_t iteration, double objective) {
    return ProgressTest::State{iteration, objective, 1, 1, iteration};
  };
  EXPECT_FALSE(test.ends(at(0, 2)));
  EXPECT_FALSE(test.ends(at(1, 1)));
  EXPECT_FALSE(test.ends(at(20, 1 - 1e-15)));
  EXPECT_TRUE(test.ends(at(21, 1)));
  EXPECT_TRUE(test.at_rounding());
  EXPECT_FALSE(test.stalled());
}

TEST(ProgressTest, WaitsForSpringsAsLongAsTheyFall) {
  ProgressTest test(false);
  for (int64_t k = 0; k <= 10000; ++k)
    EXPECT_FALSE(test.ends({k, 1 - 1e-12 * static_cast<double>(k), 1, 1, k}));
}

}  // namespace progress_test
}  // namespace repose::solve
