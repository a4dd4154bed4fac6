#include "repose/base/text.h"

#include <gtest/gtest.h>

#include <limits>

namespace repose::base {
namespace text_test {

TEST(Text, NumbersAreReadAsAWhole) {
  EXPECT_EQ(parse_number("8"), 8.0);
  EXPECT_EQ(parse_number("-.5"), -0.5);
  EXPECT_EQ(parse_number("+1e-3"), 1e-3);
  for (const char* bad : {"", " 1", "1 ", "8 mm", "1,5", "nan", "inf", "-inf", ".inf", "1e999",
                          "0x10", "+-1", "twelve", "--1", "+"})
    EXPECT_FALSE(parse_number(bad)) << bad;
}

TEST(Text, WholeNumbers) {
  EXPECT_EQ(parse_integer("-12"), -12);
  EXPECT_EQ(parse_integer("+4"), 4);
  for (const char* bad : {"4.0", "1e3", "", "99999999999999999999", "4 mm"})
    EXPECT_FALSE(parse_integer(bad)) << bad;
}

TEST(Text, TrimmedOfBlanksAroundIt) {
  EXPECT_EQ(trimmed(" \t a b\r\n"), "a b");
  EXPECT_EQ(trimmed(" \n"), "");
}

TEST(Text, ShownIsOneShortLine) {
  EXPECT_EQ(quote("a\nb\tc"), "'a?b?c'");
  EXPECT_EQ(quote(std::string(1000, 'x')), "'" + std::string(60, 'x') + "...'");
}

TEST(Range, ContainsItsEndsUnlessExcluded) {
  EXPECT_FALSE(Range::above(0).contains(0));
  EXPECT_TRUE(Range::at_least(0).contains(0));
  EXPECT_TRUE(Range::between(2, 64).contains(2));
  EXPECT_TRUE(Range::between(2, 64).contains(64));
  EXPECT_FALSE(Range::between(2, 64).contains(65));
  EXPECT_FALSE(Range{}.contains(std::numeric_limits<double>::quiet_NaN()));
}

TEST(Range, SaysItself) {
  EXPECT_EQ(Range{}.text(), "");
  EXPECT_EQ(Range::above(0).text(), "> 0");
  EXPECT_EQ(Range::at_least(1.5).text(), "≥ 1.5");
  EXPECT_EQ(Range::between(0, 1).text(), "0 … 1");
  EXPECT_EQ((Range{.min = 0, .max = 5, .min_excluded = true}.text()), "> 0 and ≤ 5");
}

}  // namespace text_test
}  // namespace repose::base
