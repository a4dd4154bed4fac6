#include "repose/solve/tangent_solver.h"

#include "repose/base/error.h"

namespace repose::solve {

using base::check;

namespace {

void set_default(const char* name, const char* value) {
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, name, &given));
  if (!given) check(PetscOptionsSetValue(nullptr, name, value));
}

void choose_preconditioner(PC pc, int64_t unknowns) {
  if (unknowns <= TangentSolver::direct_limit) {
    check(PCSetType(pc, PCCHOLESKY));
    check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    return;
  }
  check(PCSetType(pc, PCGAMG));
  set_default("-mg_levels_ksp_type", "chebyshev");
  set_default("-mg_levels_pc_type", "jacobi");
}

}  // namespace

TangentSolver::TangentSolver(Positions& positions, Hessian& hessian)
    : hessian_(hessian), work_(positions.make_vector()) {
  check(KSPCreate(positions.comm(), krylov_.out()));
  check(KSPSetType(krylov_, KSPCG));
  check(KSPSetNormType(krylov_, KSP_NORM_NATURAL));
  check(KSPSetTolerances(krylov_, 1e-3, 0.0, PETSC_DEFAULT, 500));
  choose_preconditioner(preconditioner(), 3 * positions.part().total_unknowns);
  check(KSPSetOperators(krylov_, hessian_.exact(), hessian_.convex()));
  base::check_options(KSPSetFromOptions(krylov_));
}

PC TangentSolver::preconditioner() {
  PC pc = nullptr;
  check(KSPGetPC(krylov_, &pc));
  return pc;
}

bool TangentSolver::solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance) {
  hessian_.assemble(displacement);
  check(KSPSetOperators(krylov_, hessian_.exact(), hessian_.convex()));
  check(KSPSetTolerances(krylov_, relative_tolerance, 0.0, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPSolve(krylov_, rhs, delta));
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(krylov_, &reason));
  if (reason == KSP_DIVERGED_PC_FAILED || reason == KSP_DIVERGED_NANORINF)
    throw base::InternalError("the preconditioner of the stiffness matrix could not be made");
  return reason != KSP_DIVERGED_INDEFINITE_MAT && reason != KSP_DIVERGED_INDEFINITE_PC;
}

double TangentSolver::newton_distance(Vec displacement, Vec gradient) {
  check(VecSet(work_, 0));
  const bool convex = solve(displacement, gradient, work_, 0.05);
  return convex ? largest_block(work_) : std::numeric_limits<double>::infinity();
}

}  // namespace repose::solve
