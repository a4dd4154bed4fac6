#include "repose/linear/tangent_solver.h"

#include <gtest/gtest.h>

#include "moved_block.h"
#include "repose/base/agreement.h"
#include "repose/base/options.h"
#include "repose/discrete/tangent.h"
#include "repose/solve/load_path.h"

namespace repose {
namespace tangent_solver_test {

using base::check;

/// A slab of tissue on bone, its springs at rest, large enough for several levels.
model::Model slab_on_bone() {
  return testing::block(24, 24, 4, 2, [](int, int, int a) {
    return a == 3 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

/// That bone goes aside with the load.
model::Model slab_on_moving_bone() {
  model::Model slab = slab_on_bone();
  for (Vec3& target : slab.points.target) target += Vec3(0, 1, 0);
  return slab;
}

struct Solved : testing::MovedBlock {
  discrete::Objective objective;
  discrete::Tangent tangent{objective};
  linear::TangentSolver solver{positions, tangent};
  base::VecHandle rhs = vector(5, 1.0), answer = positions.make_vector();

  explicit Solved(mechanics::VolumeTerm term = mechanics::VolumeTerm::penalty,
                  model::Model model = slab_on_bone())
      : MovedBlock(std::move(model)), objective(positions, {1, term, 0.4}) {}
  /// Drawn out along x, the more the farther: springs a thousand times stiffer than others.
  base::VecHandle drawn_out() const {
    std::vector<Vec3> values = part.model.points.position;
    for (Vec3& at : values) at = {5e-3 * at.x() * at.x(), 0, 0};
    base::VecHandle v = positions.make_vector();
    positions.restrict_to_owned(values, v);
    return v;
  }
  bool solve(Vec at, double tolerance) {
    check(VecSet(answer, 0));
    return solver.solve(at, rhs, answer, tolerance);
  }
  /// Residual by the entries of the exact Hessian, not by its action.
  double residual(Vec at) {
    tangent.assemble(at);
    base::VecHandle left = positions.make_vector();
    check(MatMult(tangent.exact(), answer, left));
    check(VecAXPY(left, -1, rhs));
    return discrete::largest_block(left) / discrete::largest_block(rhs);
  }
};

class Preconditioner : public ::testing::TestWithParam<const char*> {};

TEST_P(Preconditioner, SolvesForTheExactHessian) {
  const base::ScopedOption type("-pc_type", GetParam());
  Solved s;
  const base::VecHandle at = s.vector(1, 0.05);
  ASSERT_TRUE(s.solve(at, 1e-12));
  EXPECT_LT(s.residual(at), 1e-9);
}

TEST_P(Preconditioner, MadeElsewhereChangesNoAnswer) {
  const base::ScopedOption type("-pc_type", GetParam());
  Solved s;
  const base::VecHandle before = s.vector(1, 0.05), after = s.vector(2, 0.05);
  s.solve(before, 1e-12);
  ASSERT_TRUE(s.solve(after, 1e-12));
  EXPECT_EQ(s.solver.renewals(), 1);
  EXPECT_LT(s.residual(after), 1e-9);
}

TEST_P(Preconditioner, IsRenewedWhereItIsWornOut) {
  const base::ScopedOption type("-pc_type", GetParam());
  Solved s(mechanics::VolumeTerm::none);
  const base::VecHandle before = s.positions.make_vector(), after = s.drawn_out();
  s.solve(before, 1e-6);
  s.solve(after, 1e-6);
  EXPECT_EQ(s.solver.renewals(), 1);
  s.solve(after, 1e-6);
  EXPECT_EQ(s.solver.renewals(), 2);
}

TEST(Predictor, RenewsThePreconditionerWhereIterationsRunOut) {
  const base::ScopedOption maximum("-ksp_max_it", "90");
  Solved s(mechanics::VolumeTerm::none, slab_on_moving_bone());
  solve::Predictor predictor(s.objective, s.solver);
  s.positions.set_load(0);
  s.solve(s.positions.make_vector(), 1e-6);
  EXPECT_TRUE(predictor.predict(s.drawn_out(), 1, s.answer));
  EXPECT_EQ(s.solver.renewals(), 2);
}

TEST(Predictor, PredictsNothingWhereIterationsRunOut) {
  const base::ScopedOption maximum("-ksp_max_it", "2");
  Solved s(mechanics::VolumeTerm::none, slab_on_moving_bone());
  solve::Predictor predictor(s.objective, s.solver);
  s.positions.set_load(0);
  EXPECT_FALSE(predictor.predict(s.drawn_out(), 1, s.answer));
}

TEST(TangentSolver, GivesHopelessMultigridUpForFactors) {
  const auto by_factors_after = [](double bulk_modulus) {
    Solved s;
    s.objective.set_volume_weight(bulk_modulus);
    linear::TangentSolver solver(s.positions, s.tangent);
    const base::VecHandle start = s.positions.make_vector(), next = s.vector(1, 1e-12);
    solver.solve(start, s.rhs, s.answer, 1e-6);
    EXPECT_FALSE(solver.by_factors());
    EXPECT_TRUE(solver.solve(next, s.rhs, s.answer, 1e-10));
    EXPECT_LT(s.residual(next), 1e-6);
    return solver.by_factors();
  };
  EXPECT_FALSE(by_factors_after(0.4));
  EXPECT_TRUE(by_factors_after(4e5));
}

TEST(TangentSolver, KeepsMultigridAfterOneSlowSolve) {
  const base::ScopedOption few("-ksp_max_it", "200");
  Solved s;
  s.objective.set_volume_weight(1e3);
  linear::TangentSolver solver(s.positions, s.tangent);
  solver.solve(s.positions.make_vector(), s.rhs, s.answer, 1e-6);
  EXPECT_FALSE(solver.finished());
  solver.solve(s.vector(1, 1e-12), s.rhs, s.answer, 1e-6);
  EXPECT_FALSE(solver.by_factors());
}

INSTANTIATE_TEST_SUITE_P(Types, Preconditioner, ::testing::Values("cholesky", "columns", "gamg"));

}  // namespace tangent_solver_test
}  // namespace repose
