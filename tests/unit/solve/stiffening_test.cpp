#include "repose/solve/stiffening.h"

#include <gtest/gtest.h>

#include "moved_block.h"
#include "repose/model/build.h"
#include "repose/solve/problem.h"
#include "rest.h"

namespace repose {
namespace {

using mechanics::VolumeTerm;
using model::PointSet;

/// A block on bone, one side of which goes 6 mm sideways and up.
model::Model sheared_block() {
  model::Model m = testing::block(9, 8, 4, 2, [](int i, int, int a) {
    return i == 0 || a == 3 ? PointSet::bone : PointSet::soft_tissue;
  });
  testing::aim(m, [](const Vec3& x) { return x.x() == 0 ? Vec3(x + Vec3(-1, 5, 3)) : x; });
  return m;
}

/// κ of `times` the block's effective modulus.
double bulk_modulus(double times) { return times * model::effective_modulus(sheared_block()); }

struct Sheared : testing::MovedBlock {
  solve::Problem problem;
  solve::Predictor predictor{problem.objective(), problem.elastic_solver()};
  solve::Minimiser minimiser{problem.function(), problem.solver(), {}};
  solve::Stiffening stiffening{problem, predictor, minimiser};

  explicit Sheared(const mechanics::Weights& weights)
      : MovedBlock(sheared_block()), problem(positions, weights, false) {}
};

TEST(Stiffening, PaysWhereTheVolumeTermIsStiffButNotTooStiff) {
  for (const auto& [times, pays] : {std::pair{5.0, false}, {30.0, true}, {1e3, true}, {3e3, false}})
    EXPECT_EQ(Sheared({1, VolumeTerm::penalty, bulk_modulus(times)}).stiffening.pays(), pays)
        << times;
  EXPECT_FALSE(Sheared({1, VolumeTerm::none, 0}).stiffening.pays());
}

TEST(Stiffening, TakesThePaperTermForThePenaltyOfAsStiffPrisms) {
  // All prisms of the block have the volume 5 · 5 · 3 / 2, so (1 − λ) (v − v_0)² is that penalty.
  constexpr double volume = 37.5, lambda = 0.4;
  for (const auto& [times, pays] : {std::pair{15.0, false}, {25.0, true}})
    EXPECT_EQ(Sheared({lambda, VolumeTerm::paper, lambda * bulk_modulus(times) / (2 * volume)})
                  .stiffening.pays(),
              pays)
        << times;
}

TEST(Stiffening, LeadsNearTheRestPositionAndLeavesEverythingElseAsItWas) {
  const mechanics::Weights weights{1, VolumeTerm::penalty, bulk_modulus(300)};
  Sheared sheared(weights);
  base::VecHandle guess = sheared.positions.make_vector();
  ASSERT_TRUE(sheared.stiffening.run(guess, {}));
  EXPECT_EQ(sheared.problem.objective().weights().volume_weight, weights.volume_weight);
  EXPECT_EQ(sheared.positions.load(), 0);

  sheared.positions.set_load(1);
  base::VecHandle rest = sheared.positions.make_vector();
  base::check(VecCopy(guess, rest));
  ASSERT_TRUE(sheared.minimiser.run(rest, 1e-6).converged);
  base::check(VecAXPY(guess, -1, rest));
  EXPECT_LT(discrete::largest_block(guess), 0.2 * discrete::largest_block(rest));
}

TEST(Stiffening, LeadsWhereTheBonesLeadInManySteps) {
  solve::Settings settings;
  settings.weights = {1, VolumeTerm::penalty, bulk_modulus(300)};
  settings.path.accuracy = 1e-7;
  const testing::Rest led = testing::find_rest(sheared_block(), settings);
  EXPECT_TRUE(led.summary.path.leapt);
  settings.path.load_steps = 6;
  const testing::Rest followed = testing::find_rest(sheared_block(), settings);
  EXPECT_FALSE(followed.summary.path.leapt);
  double apart = 0;
  for (size_t i = 0; i < led.rows.position.size(); ++i)
    apart = std::max(apart, (led.rows.position[i] - followed.rows.position[i]).norm());
  EXPECT_LT(apart, 2e-7);
}

}  // namespace
}  // namespace repose
