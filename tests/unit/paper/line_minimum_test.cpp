#include "paper/line_minimum.h"

#include <gtest/gtest.h>

#include <cmath>

namespace repose::paper {
namespace line_minimum_test {

struct Case {
  const char* name;
  LineFunction f;
  double first, second, minimum;
};

class Lines : public ::testing::TestWithParam<Case> {};

TEST_P(Lines, BracketHoldsTheMinimum) {
  const Case& c = GetParam();
  const Bracket found = bracket_minimum(c.f, c.first, c.second);
  EXPECT_GT((found.c - found.b) * (found.b - found.a), 0);
  EXPECT_LE(found.value_b, c.f(found.a));
  EXPECT_LE(found.value_b, c.f(found.c));
  EXPECT_EQ(found.value_b, c.f(found.b));
}

TEST_P(Lines, BrentFindsTheMinimum) {
  const Case& c = GetParam();
  const LineMinimum found = brent_minimum(c.f, bracket_minimum(c.f, c.first, c.second), 1e-7);
  EXPECT_NEAR(found.place, c.minimum, 1e-4 * std::max(1.0, std::abs(c.minimum)));
  EXPECT_EQ(found.value, c.f(found.place));
}

INSTANTIATE_TEST_SUITE_P(
    Functions, Lines,
    ::testing::Values(
        Case{"parabola", [](double x) { return (x - 3) * (x - 3); }, 0, 1, 3},
        Case{"far", [](double x) { return (x - 3000) * (x - 3000); }, 0, 1, 3000},
        Case{"behind", [](double x) { return std::cosh(x + 2); }, 0, 1, -2},
        Case{"steep", [](double x) { return std::pow(100 * x - 1, 6) + std::pow(100 * x - 1, 2); },
             0, 1, 0.01},
        Case{"cosine", [](double x) { return std::cos(x); }, 2, 2.5, 3.14159265}),
    [](const auto& info) { return info.param.name; });

TEST(Brent, TakesFewValuesOfASmoothFunction) {
  int values = 0;
  const LineFunction f = [&](double x) {
    ++values;
    return std::exp(x) - 2 * x;
  };
  EXPECT_NEAR(brent_minimum(f, bracket_minimum(f, 0, 1), 2e-4).place, std::log(2), 1e-3);
  EXPECT_LE(values, 15);
}

}  // namespace line_minimum_test
}  // namespace repose::paper
