#include "repose/linear/tangent_solver.h"

#include <gtest/gtest.h>

#include "repose/base/options.h"
#include "solved.h"

namespace repose {
namespace tangent_solver_test {

using testing::Solved;

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
  EXPECT_EQ(s.solver.preconditioner().renewals(), 1);
  EXPECT_LT(s.residual(after), 1e-9);
}

TEST_P(Preconditioner, IsRenewedWhereItIsWornOut) {
  const base::ScopedOption type("-pc_type", GetParam());
  Solved s(mechanics::VolumeTerm::none);
  const base::VecHandle before = s.positions.make_vector(), after = s.drawn_out();
  s.solve(before, 1e-6);
  s.solve(after, 1e-6);
  EXPECT_EQ(s.solver.preconditioner().renewals(), 1);
  s.solve(after, 1e-6);
  EXPECT_EQ(s.solver.preconditioner().renewals(), 2);
}

TEST_P(Preconditioner, KnowsTheProductOfARoughSolution) {
  const base::ScopedOption type("-pc_type", GetParam());
  Solved s;
  const base::VecHandle at = s.vector(1, 0.05), known = s.positions.make_vector(),
                        product = s.positions.make_vector();
  s.solve(at, 0.3);
  s.solver.product_of_solution(s.rhs, known);
  base::check(MatMult(s.tangent.action(), s.answer, product));
  PetscReal length = 0, apart = 0;
  base::check(VecNorm(product, NORM_2, &length));
  base::check(VecAXPY(product, -1.0, known));
  base::check(VecNorm(product, NORM_2, &apart));
  EXPECT_LT(apart, 1e-10 * length);
}

TEST(TangentSolver, GivesHopelessMultigridUpForFactors) {
  const auto by_factors_after = [](double bulk_modulus) {
    Solved s;
    s.objective.set_volume_weight(bulk_modulus);
    linear::TangentSolver solver(s.positions, s.tangent);
    const base::VecHandle start = s.positions.make_vector(), next = s.vector(1, 1e-12);
    solver.solve(start, s.rhs, s.answer, 1e-6);
    EXPECT_FALSE(solver.preconditioner().by_factors());
    EXPECT_TRUE(solver.solve(next, s.rhs, s.answer, 1e-10));
    EXPECT_LT(s.residual(next), 1e-6);
    return solver.preconditioner().by_factors();
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
  EXPECT_FALSE(solver.preconditioner().by_factors());
}

/// Diagonal of fours, but for a block of ones, which is singular.
class Singular : public discrete::Hessian {
 public:
  explicit Singular(Vec unknowns) {
    PetscInt owned = 0, first = 0, last = 0;
    base::check(VecGetLocalSize(unknowns, &owned));
    base::check(MatCreateAIJ(MPI_COMM_WORLD, owned, owned, PETSC_DETERMINE, PETSC_DETERMINE, 2,
                             nullptr, 0, nullptr, matrix_.out()));
    base::check(MatGetOwnershipRange(matrix_, &first, &last));
    for (PetscInt i = first; i < last; ++i)
      for (PetscInt j = i < 2 ? 0 : i; j < (i < 2 ? 2 : i + 1); ++j)
        base::check(MatSetValue(matrix_, i, j, i < 2 ? 1 : 4, INSERT_VALUES));
    base::check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
    base::check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
    base::check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
  }
  void assemble(Vec) override { ++assemblies_; }
  Mat exact() override { return matrix_; }
  Mat spd_approximation() override { return matrix_; }
  bool elliptic() const override { return false; }

 private:
  base::MatHandle matrix_;
};

TEST(TangentSolver, NamesStiffnessesThatLieTooFarApart) {
  Solved s;
  Singular singular(s.rhs);
  linear::TangentSolver solver(s.positions, singular);
  try {
    solver.solve(s.rhs, s.rhs, s.answer, 1e-6);
    FAIL() << "solved";
  } catch (const base::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("the largest 4 times the smallest, lie too far apart"),
              std::string::npos)
        << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(Types, Preconditioner, ::testing::Values("cholesky", "columns", "gamg"));

}  // namespace tangent_solver_test
}  // namespace repose
