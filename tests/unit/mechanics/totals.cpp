#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "assembled.h"
#include "states.h"

namespace repose::mechanics {
namespace totals_test {

using test::State;

/// Spring energy of docs/theory/model.md, in long double.
long double plain_spring_energy(const model::Model& model, const std::vector<Vec3>& x, size_t e) {
  const auto [i, j] = model.springs.points[e];
  const Eigen::Matrix<long double, 3, 1> d = x[j].cast<long double>() - x[i].cast<long double>();
  const long double s = d.norm() - model.springs.rest_length[e];
  const long double strain2 = std::pow(s / model.springs.reference[e], 2);
  const long double stiffening[] = {1, 1 + strain2 / 2, 1 + strain2 + strain2 * strain2 / 3};
  return model.springs.stiffness[e] * s * s / 2 * stiffening[model.springs.exponent[e]];
}

/// The totals over the first rows of a model all of whose elements have a soft-tissue point.
Totals plain_totals(const model::Model& model, const std::vector<Vec3>& x, int64_t springs,
                    int64_t prisms) {
  Totals sum;
  for (int64_t e = 0; e < springs; ++e) {
    const auto [i, j] = model.springs.points[e];
    if (std::min(model.points.layer[i], model.points.layer[j]) < 2)
      sum.spring_energy += static_cast<double>(plain_spring_energy(model, x, e));
  }
  for (int64_t e = 0; e < prisms; ++e) {
    Vec3 corners[6];
    for (int c = 0; c < 6; ++c) corners[c] = x[model.prisms.points[e][c]];
    const double v = model::prism_volume(corners), v0 = model.prisms.rest_volume[e];
    sum.volume_squares += std::pow(v0 - v, 2);
    sum.penalty_unit += std::pow(v0 - v, 2) / (2 * v0);
    sum.volume_error_max = std::max(sum.volume_error_max, std::abs(v - v0) / v0);
    if (v <= 0) ++sum.inverted;
  }
  return sum;
}

class TotalsOfAState : public ::testing::TestWithParam<test::StateInfo> {};

TEST_P(TotalsOfAState, AreThePlainSumsOverWhatIsCounted) {
  const model::Model model = test::uneven_patch();
  const auto x = test::positions(model, GetParam().state);
  const auto all = static_cast<int64_t>(model.springs.points.size());
  for (const auto& [springs, prisms] : {std::pair<int64_t, int64_t>(all, 23), {70, 5}, {0, 0}}) {
    const Totals sum = totals(make_loops(model, springs, prisms), x);
    const Totals plain = plain_totals(model, x, springs, prisms);
    EXPECT_NEAR(sum.spring_energy, plain.spring_energy, 1e-12 * plain.spring_energy);
    EXPECT_NEAR(sum.volume_squares, plain.volume_squares, 1e-12 * plain.volume_squares);
    EXPECT_NEAR(sum.penalty_unit, plain.penalty_unit, 1e-12 * plain.penalty_unit);
    EXPECT_NEAR(sum.volume_error_max, plain.volume_error_max, 1e-13 * plain.volume_error_max);
    EXPECT_EQ(sum.inverted, plain.inverted);
  }
}

TEST_P(TotalsOfAState, AgreeWithTheGradientKernels) {
  const model::Model model = test::uneven_patch();
  const auto x = test::positions(model, GetParam().state);
  for (const auto& [springs, prisms] : {std::pair<int64_t, int64_t>(70, 5), {116, 23}}) {
    const Loops loops = make_loops(model, springs, prisms);
    const Totals sum = totals(loops, x);
    std::vector<Vec3> gradient(x.size(), Vec3::Zero());
    double energy = 0;
    for (const SpringLoop& loop : loops.springs)
      energy += add_spring_gradient(loop, x, 3.0, gradient);
    EXPECT_NEAR(energy, sum.spring_energy, 1e-13 * sum.spring_energy);
    EXPECT_NEAR(add_prism_gradient(loops.prisms, x, {1, VolumeTerm::paper, 0.5}, gradient),
                0.5 * sum.volume_squares, 1e-13 * sum.volume_squares);
    EXPECT_NEAR(add_prism_gradient(loops.prisms, x, {1, VolumeTerm::penalty, 2.0}, gradient),
                2.0 * sum.penalty_unit, 1e-13 * sum.penalty_unit);
  }
}

INSTANTIATE_TEST_SUITE_P(States, TotalsOfAState, testing::ValuesIn(test::all_states),
                         [](const auto& info) { return std::to_string(info.index); });

TEST(Totals, CountsInvertedAndFlatPrisms) {
  const model::Model model = test::uneven_patch();
  const auto inverted = [&](State state) {
    return totals(make_loops(model, 0, 23), test::positions(model, state)).inverted;
  };
  EXPECT_EQ(inverted(State::mild), 0);
  EXPECT_EQ(inverted(State::inverted), 23);
  EXPECT_EQ(inverted(State::flat), 23);
}

TEST(Gradients, AddToWhatIsThereWhetherCountedOrNot) {
  const model::Model model = test::uneven_patch();
  const auto x = test::positions(model, State::mild);
  const Weights weights{0.7, VolumeTerm::paper, 1.3};
  const Loops here = make_loops(model, 161, 6), elsewhere = make_loops(model, 0, 0);
  EXPECT_EQ(test::evaluate(elsewhere, weights, x).value, 0.0);
  const Eigen::VectorXd g = test::evaluate(here, weights, x).gradient;
  EXPECT_LE((test::evaluate(elsewhere, weights, x).gradient - g).norm(), 1e-14 * g.norm());
  std::vector<Vec3> gradient(x.size(), Vec3(1e3, 0, 0));
  add_spring_gradient(here.springs[0], x, 2.0, gradient);
  std::vector<Vec3> alone(x.size(), Vec3::Zero());
  add_spring_gradient(here.springs[0], x, 1.0, alone);
  for (size_t i = 0; i < x.size(); ++i)
    EXPECT_LT((gradient[i] - Vec3(1e3, 0, 0) - 2.0 * alone[i]).norm(), 1e-11);
}

TEST(Gradients, NoVolumeTermMeansNoPrisms) {
  const model::Model model = test::uneven_patch();
  const auto x = test::positions(model, State::mild);
  const Loops loops = make_loops(model, 161, 23);
  std::vector<Vec3> gradient(x.size(), Vec3::Zero());
  EXPECT_EQ(add_prism_gradient(loops.prisms, x, {1, VolumeTerm::none, 5}, gradient), 0.0);
  for (const Vec3& g : gradient) EXPECT_EQ(g, Vec3::Zero());
}

}  // namespace totals_test
}  // namespace repose::mechanics
