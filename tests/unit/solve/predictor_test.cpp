#include <gtest/gtest.h>

#include "../linear/solved.h"
#include "repose/base/options.h"
#include "repose/solve/load_path.h"

namespace repose {
namespace predictor_test {

using testing::Solved;

/// A slab of tissue on bone that goes aside with the load.
model::Model slab_on_moving_bone() {
  model::Model slab = testing::slab_on_bone();
  for (Vec3& target : slab.points.target) target += Vec3(0, 1, 0);
  return slab;
}

TEST(Predictor, RenewsThePreconditionerWhereIterationsRunOut) {
  const base::ScopedOption maximum("-ksp_max_it", "90");
  Solved s(mechanics::VolumeTerm::none, slab_on_moving_bone());
  solve::Predictor predictor(s.objective, s.solver);
  s.positions.set_load(0);
  s.solve(s.positions.make_vector(), 1e-6);
  EXPECT_TRUE(predictor.predict(s.drawn_out(), 1, s.answer));
  EXPECT_EQ(s.solver.preconditioner().renewals(), 2);
}

TEST(Predictor, PredictsNothingWhereIterationsRunOut) {
  const base::ScopedOption maximum("-ksp_max_it", "2");
  Solved s(mechanics::VolumeTerm::none, slab_on_moving_bone());
  solve::Predictor predictor(s.objective, s.solver);
  s.positions.set_load(0);
  EXPECT_FALSE(predictor.predict(s.drawn_out(), 1, s.answer));
}

}  // namespace predictor_test
}  // namespace repose
