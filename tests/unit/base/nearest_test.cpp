#include "repose/base/text.h"

#include <gtest/gtest.h>

namespace repose::base {
namespace nearest_test {

TEST(Nearest, DistanceCountsEdits) {
  EXPECT_EQ(edit_distance("", ""), 0u);
  EXPECT_EQ(edit_distance("", "skin"), 4u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("skni", "skin"), 1u) << "a swap of neighbors is one edit";
  EXPECT_EQ(edit_distance("Layers", "layers"), 0u) << "case does not count";
}

TEST(Nearest, IsSymmetric) {
  for (const char* a : {"", "turgor", "trugor", "mass", "depths"})
    for (const char* b : {"density", "turgor", "x"})
      EXPECT_EQ(edit_distance(a, b), edit_distance(b, a));
}

TEST(Nearest, PicksTheClosestName) {
  const std::vector<std::string> known{"accuracy", "functional", "lambda"};
  EXPECT_EQ(nearest("acuracy", known), "accuracy");
  EXPECT_EQ(nearest("lamda", known), "lambda");
  EXPECT_EQ(nearest("x", {}), "");
}

TEST(Nearest, EndsOnLongGarbage) {
  EXPECT_EQ(nearest(std::string(1 << 20, 'q'), {"quadratic", "x"}), "quadratic");
}

}  // namespace nearest_test
}  // namespace repose::base
