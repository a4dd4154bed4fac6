#include <gtest/gtest.h>

#include "assembled.h"
#include "states.h"

/// Terms that a scene does not mention cost nothing. tests/program/test_unused_terms.py counts the
/// instructions of evaluate_often() in each of these cases.
namespace repose::mechanics {

/// Objective, gradient and Hessian action, as often as a solve asks for them before it has begun.
[[gnu::noinline]] double evaluate_often(const Loops& loops, const Weights& weights,
                                        const std::vector<Vec3>& x, std::vector<Vec3>& sums) {
  double value = 0;
  for (int k = 0; k < 20; ++k) {
    for (const SpringLoop& loop : loops.springs)
      value += weights.elastic * add_spring_gradient(loop, x, weights.elastic, sums);
    value += add_prism_gradient(loops.prisms, x, weights, sums);
    add_hessian_action(loops, x, weights, x, sums, {});
  }
  return value;
}

namespace unused_terms_test {

/// Returns the result of evaluate_often() for a patch with or without prisms.
std::pair<double, std::vector<Vec3>> evaluated(bool prisms, const Weights& weights) {
  const model::Model model = test::layered_patch({12, 12, 4, 1.0, 0.8});
  const auto springs = static_cast<int64_t>(model.springs.points.size());
  Loops loops = make_loops(model, springs, static_cast<int64_t>(model.prisms.points.size()));
  if (!prisms) loops.prisms = {};
  const std::vector<Vec3> x = test::positions(model, test::State::mild);
  std::vector<Vec3> sums(x.size(), Vec3::Zero());
  const double value = evaluate_often(loops, weights, x, sums);
  return {value, sums};
}

const auto springs_alone = [] { return evaluated(false, {1, VolumeTerm::none, 0}); };

TEST(UnusedTerms, NoPrisms) { EXPECT_GT(springs_alone().first, 0); }

TEST(UnusedTerms, PrismsWithoutVolumeTerm) {
  EXPECT_GT(evaluated(true, {1, VolumeTerm::none, 5}).first, 0);
}

TEST(UnusedTerms, PrismsWithVolumeTerm) {
  EXPECT_GT(evaluated(true, {1, VolumeTerm::penalty, 5}).first, 0);
}

TEST(UnusedTermsAre, NoPartOfTheSums) {
  EXPECT_EQ(evaluated(true, {1, VolumeTerm::none, 5}), springs_alone());
  EXPECT_NE(evaluated(true, {1, VolumeTerm::penalty, 5}), springs_alone());
}

}  // namespace unused_terms_test
}  // namespace repose::mechanics
