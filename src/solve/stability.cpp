#include "repose/solve/stability.h"

#include <slepceps.h>

#include <cmath>

#include "repose/base/error.h"

namespace repose::solve {

using base::check;

namespace {

using EpsHandle = base::Handle<EPS, EPSDestroy>;

/// SLEPc, started at first use and ended with PETSc.
void start_slepc() {
  PetscBool started = PETSC_FALSE;
  check(SlepcInitialized(&started));
  if (started) return;
  check(SlepcInitializeNoArguments());
  check(PetscRegisterFinalize(SlepcFinalize));
}

double largest_diagonal(Mat matrix) {
  base::VecHandle diagonal;
  check(MatCreateVecs(matrix, diagonal.out(), nullptr));
  check(MatGetDiagonal(matrix, diagonal));
  PetscReal largest = 0;
  check(VecNorm(diagonal, NORM_INFINITY, &largest));
  return largest;
}

/// Returns the number of eigenvalues below `shift`: that of negative pivots of H − shift.
PetscInt eigenvalues_below(Mat matrix, double shift) {
  constexpr int parallel_root = 13;  // ICNTL: no ScaLAPACK, which does not know the inertia
  base::MatHandle shifted;
  check(MatDuplicate(matrix, MAT_COPY_VALUES, shifted.out()));
  check(MatShift(shifted, -shift));
  linear::PcHandle factors;
  check(PCCreate(base::comm_of(matrix), factors.out()));
  check(PCSetOperators(factors, shifted, shifted));
  linear::choose_factors(factors);
  linear::give_room(factors);
  Mat factored = nullptr;
  check(PCFactorGetMatrix(factors, &factored));
  check(MatMumpsSetIcntl(factored, parallel_root, 1));
  check(PCSetUp(factors));
  PetscInt below = 0;
  check(MatGetInertia(factored, &below, nullptr, nullptr));
  return below;
}

/// A shift below every eigenvalue, near the smallest one.
double shift_below_all(Mat matrix) {
  constexpr double first = 1e-6, last = 1e3, growth = 10;  // of the largest diagonal entry
  const double stiffest = largest_diagonal(matrix);
  double part = first;
  while (part < last && eigenvalues_below(matrix, -part * stiffest) > 0) part *= growth;
  return -part * stiffest;
}

/// Makes the eigenvalue nearest to the target the smallest one.
void choose_shift_and_invert(EPS eps, Mat matrix) {
  ST st = nullptr;
  KSP krylov = nullptr;
  PC pc = nullptr;
  check(EPSSetType(eps, EPSKRYLOVSCHUR));
  check(EPSSetWhichEigenpairs(eps, EPS_TARGET_MAGNITUDE));
  check(EPSSetTarget(eps, shift_below_all(matrix)));
  check(EPSGetST(eps, &st));
  check(STSetType(st, STSINVERT));
  check(STGetKSP(st, &krylov));
  check(KSPSetType(krylov, KSPPREONLY));
  check(KSPGetPC(krylov, &pc));
  linear::choose_factors(pc);
}

void choose_preconditioned(EPS eps, linear::TangentSolver& solver) {
  ST st = nullptr;
  KSP krylov = nullptr;
  check(EPSSetType(eps, EPSGD));
  check(EPSSetWhichEigenpairs(eps, EPS_SMALLEST_REAL));
  check(EPSGetST(eps, &st));
  check(STSetType(st, STPRECOND));
  check(STSetPreconditionerMat(st, solver.preconditioner().matrix()));
  check(STGetKSP(st, &krylov));
  check(KSPSetType(krylov, KSPPREONLY));
  check(KSPSetPC(krylov, solver.preconditioner()));
}

EpsHandle symmetric_problem(Mat matrix, double tolerance, int maximum) {
  start_slepc();
  EpsHandle eps;
  check(EPSCreate(base::comm_of(matrix), eps.out()));
  check(EPSSetOperators(eps, matrix, nullptr));
  check(EPSSetProblemType(eps, EPS_HEP));
  check(EPSSetTolerances(eps, tolerance, maximum));
  return eps;
}

double first_eigenvalue(EPS eps) {
  check(EPSSolve(eps));
  PetscInt converged = 0;
  check(EPSGetConverged(eps, &converged));
  if (converged == 0) return std::nan("");
  PetscScalar value = 0;
  check(EPSGetEigenvalue(eps, 0, &value, nullptr));
  return value;
}

void scale_mode(Vec mode) {
  PetscReal maximum = 0, minimum = 0;
  check(VecMax(mode, nullptr, &maximum));
  check(VecMin(mode, nullptr, &minimum));
  check(VecScale(mode, (maximum >= -minimum ? 1 : -1) / discrete::largest_block(mode)));
}

double first_mode(EPS eps, Vec mode) {
  const double value = first_eigenvalue(eps);
  check(VecSet(mode, 0));
  if (std::isnan(value)) return value;
  check(EPSGetEigenvector(eps, 0, mode, nullptr));
  scale_mode(mode);
  return value;
}

}  // namespace

double largest_eigenvalue(Mat hessian) {
  const EpsHandle eps = symmetric_problem(hessian, 1e-2, 1000);
  check(EPSSetWhichEigenpairs(eps, EPS_LARGEST_REAL));
  return first_eigenvalue(eps);
}

double smallest_eigenvalue(linear::TangentSolver& solver, Vec displacement, Vec mode,
                           int64_t direct_limit) {
  constexpr double tolerance = 1e-8;  // of the eigenvalue
  constexpr int maximum = 2000;       // iterations
  solver.prepare(displacement);
  const Mat exact = solver.hessian().exact();
  PetscInt unknowns = 0;
  check(MatGetSize(exact, &unknowns, nullptr));
  const EpsHandle eps = symmetric_problem(exact, tolerance, maximum);
  if (unknowns <= direct_limit)
    choose_shift_and_invert(eps, exact);
  else
    choose_preconditioned(eps, solver);
  check(EPSSetFromOptions(eps));
  return first_mode(eps, mode);
}

double rough_smallest_eigenvalue(linear::TangentSolver& solver, Vec displacement, Vec mode) {
  constexpr double tolerance = 0.1;  // of the eigenvalue
  constexpr int maximum = 200;       // iterations
  solver.prepare(displacement);
  const Mat action = solver.hessian().action();
  double value = 0;
  {
    const EpsHandle eps = symmetric_problem(action, tolerance, maximum);
    choose_preconditioned(eps, solver);
    value = first_mode(eps, mode);
  }
  // SLEPc takes them away from the preconditioner that it was lent.
  check(PCSetOperators(solver.preconditioner(), action, solver.preconditioner().matrix()));
  return value;
}

}  // namespace repose::solve
