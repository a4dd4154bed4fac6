#include "repose/tools/check/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace repose::tools::check {
namespace comparison_test {

std::vector<std::string> lines_with(const std::string& text, const std::string& word) {
  std::vector<std::string> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.find(word) != std::string::npos) found.push_back(line);
  return found;
}

Comparison compared(double wrong) {
  Comparison comparison(1e-9);
  for (int step = 0; step < 20; ++step) {
    comparison.begin("step " + std::to_string(step));
    comparison.number("energy", 2, step == 7 ? 2 + wrong : 2, 2);
    const std::vector<double> stored = {1, 2, 3};
    comparison.array("tension", stored, stored, 3);
    comparison.range("load", step == 9 ? wrong : 0, 0, 1);
    comparison.statement("bones move", step != 11 || wrong == 0);
  }
  return comparison;
}

TEST(Comparison, TheSummaryHasOneLineForEachNameWithItsWorstPlace) {
  const std::string text = compared(1e-12).summary();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5 + 1) << text;
  ASSERT_EQ(lines_with(text, "energy").size(), 1u);
  EXPECT_NE(text.find("5.0e-13  step 7     agrees"), std::string::npos) << text;
  EXPECT_NE(lines_with(text, "tension").at(0).find(" 60 "), std::string::npos) << "entries";
}

TEST(Comparison, TheSummaryShowsAllThatDoesNotHold) {
  const Comparison comparison = compared(4);
  const std::string text = comparison.summary();
  EXPECT_NE(lines_with(text, "energy").at(0).find("step 7     1 of 20 DISAGREE"), std::string::npos)
      << text;
  EXPECT_EQ(lines_with(text, "OUT OF RANGE").at(0).substr(0, 6), "step 9");
  EXPECT_EQ(lines_with(text, "NOT SO").at(0).substr(0, 7), "step 11");
  EXPECT_EQ(lines_with(text, ", 1 DO NOT").size(), 2u) << text;
  EXPECT_EQ(comparison.disagreeing(), 3);
}

TEST(Comparison, TheTableHasEveryNumber) {
  const std::string text = compared(0).table();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 4 * 20);
}

}  // namespace comparison_test
}  // namespace repose::tools::check
