#include "tools/check/cut_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <ranges>

#include "repose/mechanics/cut_face_contact.h"

namespace repose::tools::check {
namespace cut_faces_test {

constexpr int columns = 6, rows = 5;

/// Two sides of a cut, of which the place of a control is `first` and `second` of (column, row).
template <class First, class Second>
std::vector<Vec3> lay(model::CutFaces& cuts, First&& first, Second&& second) {
  std::vector<Vec3> position;
  cuts.size = {{columns, rows}};
  cuts.begin = {0};
  for (int side = 0; side < 2; ++side)
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < rows; ++j) {
        cuts.point.push_back(static_cast<int64_t>(position.size()));
        cuts.weight.push_back(1);
        cuts.begin.push_back(static_cast<int64_t>(cuts.point.size()));
        position.push_back(side == 0 ? first(i, j) : second(i, j));
        if (side == 0) cuts.area.push_back(j == 0 ? 0 : 1.5);
      }
  return position;
}

std::vector<double> gaps_of_solver(const model::CutFaces& cuts, std::span<const Vec3> position) {
  mechanics::CutFaceContact solver(cuts, 1);
  solver.update_gaps(position);
  std::vector<double> gaps;
  for (size_t w = 0; w < solver.size(); ++w) gaps.push_back(solver.gap(w));
  return gaps;
}

TEST(CutGaps, AreSignedDistancesBetweenPlaneSides) {
  for (const double distance : {0.8, 0.0, -0.6}) {
    model::CutFaces cuts;
    const auto position = lay(
        cuts, [&](int i, int j) { return Vec3(2 * i + 0.4, 3 * j - 0.3, distance); },
        [](int i, int j) { return Vec3(2 * i, 3 * j, 0); });
    const std::vector<CutGap> gaps = cut_gaps(cuts, position);
    ASSERT_EQ(gaps.size(), columns * (rows - 1));
    for (const CutGap& at : gaps) EXPECT_NEAR(at.gap[0], distance, 1e-9);
    EXPECT_EQ(gaps.front().point, 1);
  }
}

TEST(CutGaps, AreDistancesWhereNothingIsOpposite) {
  model::CutFaces cuts;
  const auto position = lay(
      cuts, [](int i, int j) { return Vec3(i + 20, j, 1); },
      [](int i, int j) { return Vec3(i, j, 0); });
  for (const CutGap& at : cut_gaps(cuts, position))
    EXPECT_NEAR(at.gap[1], std::hypot(position[at.point].x() - columns, 1), 1e-9);
}

TEST(CutGaps, AreThoseOfTheSolverBetweenBentSides) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> off(-0.1, 0.1);
  const auto bent = [&](double i, double j, double z) -> Vec3 {
    const double x = 2.5 * i, y = 2 * j;
    return Vec3(x, y, z + 0.04 * x * x - 0.05 * y * y) +
           Vec3(off(random), off(random), off(random));
  };
  model::CutFaces cuts;
  const auto position = lay(
      cuts, [&](int i, int j) { return bent(i + 0.4, j - 0.2, -0.8); },
      [&](int i, int j) { return bent(i, j, 0); });
  const std::vector<double> expected = gaps_of_solver(cuts, position);
  const std::vector<CutGap> gaps = cut_gaps(cuts, position);
  ASSERT_EQ(gaps.size(), expected.size());
  int behind = 0;
  for (size_t w = 0; w < gaps.size(); ++w) {
    EXPECT_NEAR(gaps[w].gap[0], expected[w], 1e-8) << w;
    behind += gaps[w].gap[0] < 0;
  }
  EXPECT_GT(behind, 0);
}

TEST(CutGaps, AreThoseOfTheNearestOfSeveralMinima) {
  for (const unsigned rough : {15, 79, 158, 173, 360, 371, 373, 398}) {
    std::mt19937 random(rough);
    std::uniform_real_distribution<double> off(-0.35, 0.35);
    const auto place = [&](double i, double j, double z) -> Vec3 {
      return Vec3(i, j, z) + Vec3(off(random), off(random), off(random));
    };
    model::CutFaces cuts;
    const auto position = lay(
        cuts, [&](int i, int j) { return place(i + 0.4, j - 0.2, 1); },
        [&](int i, int j) { return place(i, j, 0); });
    const std::vector<double> expected = gaps_of_solver(cuts, position);
    const std::vector<CutGap> gaps = cut_gaps(cuts, position);
    ASSERT_EQ(gaps.size(), expected.size());
    for (size_t w = 0; w < gaps.size(); ++w) {
      const auto off_by = [&](double gap) { return std::abs(gap - expected[w]); };
      EXPECT_LT(std::ranges::min(gaps[w].gap | std::views::transform(off_by)), 1e-8)
          << rough << ", " << w;
    }
  }
}

TEST(CutGaps, AreThoseOfTheSolverBeyondTheEndsOfASkewSide) {
  // Along the ends the nearest place is not at the same parameter as the nearest control.
  for (unsigned seed = 8; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> off(-0.1, 0.1);
    const double length = 0.4 + 0.05 * seed;
    const auto skew = [&](double i, double j, double z) -> Vec3 {
      return Vec3(length * i + 1.4 * j, 2 * j + 0.6 * i, z + 0.02 * i * j) +
             Vec3(off(random), off(random), off(random));
    };
    model::CutFaces cuts;
    const auto position = lay(
        cuts, [&](int i, int j) { return skew(i + 0.1 * seed, j + 0.6, 1.5); },
        [&](int i, int j) { return skew(i, j, 0); });
    const std::vector<double> expected = gaps_of_solver(cuts, position);
    const std::vector<CutGap> gaps = cut_gaps(cuts, position);
    ASSERT_EQ(gaps.size(), expected.size());
    for (size_t w = 0; w < gaps.size(); ++w)
      EXPECT_NEAR(gaps[w].gap[0], expected[w], 1e-7) << w << " of seed " << seed;
  }
}

}  // namespace cut_faces_test
}  // namespace repose::tools::check
