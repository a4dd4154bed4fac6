#include "repose/linear/energy_test.h"

#include <gtest/gtest.h>

#include "solved.h"

namespace repose {
namespace energy_test_test {

using base::check;
using testing::Solved;

/// Twice the energy that the answer has lowered, at the Hessian of the latest solve.
double lowered(Solved& s) {
  const base::VecHandle product = s.positions.make_vector();
  check(MatMult(s.tangent.action(), s.answer, product));
  PetscReal work = 0, curvature = 0;
  check(VecDot(s.rhs, s.answer, &work));
  check(VecDot(s.answer, product, &curvature));
  return 2 * work - curvature;
}

/// Solves a diagonal system by conjugate gradients that count how often they are preconditioned.
struct Counted {
  int64_t applications = 0;
  base::MatHandle matrix;
  base::VecHandle x, b;
  linear::KspHandle krylov;

  Counted() {
    constexpr PetscInt unknowns = 50;
    check(MatCreateConstantDiagonal(MPI_COMM_SELF, unknowns, unknowns, unknowns, unknowns, 1,
                                    matrix.out()));
    check(MatCreateVecs(matrix, x.out(), b.out()));
    check(VecSet(b, 1));
    check(KSPCreate(MPI_COMM_SELF, krylov.out()));
    check(KSPSetType(krylov, KSPCG));
    check(KSPSetNormType(krylov, KSP_NORM_NATURAL));
    check(KSPSetOperators(krylov, matrix, matrix));
    PC pc = nullptr;
    check(KSPGetPC(krylov, &pc));
    check(PCSetType(pc, PCSHELL));
    check(PCShellSetContext(pc, this));
    check(PCShellSetApply(pc, apply));
  }
  /// Divides by 1, 2, 3 …
  static PetscErrorCode apply(PC pc, Vec r, Vec z) {
    Counted* me = nullptr;
    if (const PetscErrorCode code = PCShellGetContext(pc, &me)) return code;
    ++me->applications;
    if (const PetscErrorCode code = VecCopy(r, z)) return code;
    PetscInt size = 0;
    VecGetSize(z, &size);
    for (PetscInt i = 0; i < size; ++i) {
      PetscScalar value = 0;
      VecGetValues(r, 1, &i, &value);
      VecSetValue(z, i, value / (1 + i), INSERT_VALUES);
    }
    return VecAssemblyEnd(z);
  }
  /// Returns the applications beyond one for each iteration.
  int64_t spare() {
    applications = 0;
    check(KSPSetTolerances(krylov, 0.01, 0, PETSC_DEFAULT, PETSC_DEFAULT));
    check(KSPSolve(krylov, b, x));
    PetscInt iterations = 0;
    check(KSPGetIterationNumber(krylov, &iterations));
    EXPECT_GT(iterations, 2);
    return applications - iterations;
  }
};

TEST(EnergyTest, EndsWhereIterationsLowerTheEnergyByLittle) {
  Solved s;
  const base::VecHandle at = s.vector(1, 0.05);
  ASSERT_TRUE(s.solve(at, 1e-12));
  const double all = lowered(s);
  for (const double share : {0.1, 1e-3}) {
    const linear::EnergyTest test(s.solver.krylov());
    ASSERT_TRUE(s.solve(at, share));
    EXPECT_TRUE(s.solver.finished());
    EXPECT_LT(lowered(s), all);
    EXPECT_GT(lowered(s), (1 - 2 * share) * all);
  }
}

TEST(EnergyTest, SavesAnApplicationOfThePreconditioner) {
  Counted system;
  EXPECT_EQ(system.spare(), 1);
  {
    const linear::EnergyTest test(system.krylov);
    EXPECT_EQ(system.spare(), 0);
  }
  EXPECT_EQ(system.spare(), 1);
}

}  // namespace energy_test_test
}  // namespace repose
