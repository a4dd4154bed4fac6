#include "paper/polak_ribiere.h"

#include <gtest/gtest.h>

#include "quadratic.h"
#include "repose/discrete/tangent.h"
#include "repose/solve/minimizer.h"

namespace repose::paper {
namespace polak_ribiere_test {

/// With exact line minima a quadratic of four curvatures is minimized in four iterations.
TEST(PolakRibiere, MinimizesAQuadraticInItsNumberOfCurvatures) {
  const discrete::Part part =
      discrete::build_local_from_root(MPI_COMM_WORLD, testing::resting_block()).part;
  discrete::Positions positions(MPI_COMM_WORLD, part);
  testing::Quadratic function(positions, 4);
  const base::VecHandle x = positions.make_vector();
  PolakRibiereSettings settings;
  settings.line_tolerance = 1e-8;
  settings.max_iterations = 4;
  const PolakRibiereOutcome outcome = polak_ribiere(function, x, settings);
  EXPECT_LT(outcome.value, 1e-12);
  base::check(VecShift(x, -1));
  EXPECT_LT(discrete::largest_block(x), 1e-6);
}

TEST(PolakRibiere, EndsAtOnceAtAMinimum) {
  const discrete::Part part =
      discrete::build_local_from_root(MPI_COMM_WORLD, testing::resting_block()).part;
  discrete::Positions positions(MPI_COMM_WORLD, part);
  testing::Quadratic function(positions, 4);
  const base::VecHandle x = positions.make_vector();
  base::check(VecSet(x, 1));
  EXPECT_EQ(polak_ribiere(function, x).iterations, 0);
  EXPECT_EQ(function.evaluations(), 1);
}

/// Tissue pulled sideways by its bone: the same rest position as Newton's.
TEST(PolakRibiere, FindsTheRestPositionOfTissue) {
  model::Model m = testing::resting_block();
  testing::aim(m, [](const Vec3& x) -> Vec3 { return x + Vec3(1, 0.5, -0.2 * x.x()); });
  const discrete::Part part = discrete::build_local_from_root(MPI_COMM_WORLD, m).part;
  discrete::Positions positions(MPI_COMM_WORLD, part);
  positions.set_load(1);
  discrete::Objective objective(positions, {1, mechanics::VolumeTerm::penalty, 0.3});
  discrete::Tangent tangent(objective);
  linear::TangentSolver solver(positions, tangent);
  solve::Minimizer newton(objective, solver, nullptr);
  const base::VecHandle x = positions.make_vector(), rest = positions.make_vector();
  ASSERT_TRUE(newton.run(rest, 1e-9).converged);
  polak_ribiere(objective, x);
  base::check(VecAXPY(x, -1, rest));
  EXPECT_LT(discrete::largest_block(x), 1e-4);
}

}  // namespace polak_ribiere_test
}  // namespace repose::paper
