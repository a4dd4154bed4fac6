#include "repose/solve/tangent_solver.h"

#include "repose/base/error.h"
#include "repose/base/petsc_versions.h"
#include "repose/solve/tangent_hierarchy.h"

namespace repose::solve {

using base::check;

namespace {

bool given(const char* option) {
  PetscBool set = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, option, &set));
  return set;
}

void choose_factors(PC pc) {
  check(PCSetType(pc, PCCHOLESKY));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
}

void choose_preconditioner(PC pc, int64_t unknowns, int64_t direct_limit, bool elliptic) {
  if (unknowns <= (elliptic ? direct_limit : TangentSolver::factors_limit))
    choose_factors(pc);
  else
    check(PCSetType(pc, elliptic ? PCMG : PCGAMG));
}

double price_of_renewal() {
  PetscReal price = 20;  // MUMPS' factors of a sheet of tissue cost 20 to 25 iterations with them
  check(PetscOptionsGetReal(nullptr, nullptr, "-pc_renewal_price", &price, nullptr));
  return price;
}

bool is_hierarchy(PC pc) {
  PetscBool same = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCMG, &same));
  return same;
}

}  // namespace

TangentSolver::TangentSolver(Positions& positions, Hessian& hessian, int64_t limit)
    : hessian_(hessian),
      unknowns_(3 * positions.part().total_unknowns),
      work_(positions.make_vector()),
      measured_(positions.make_vector()),
      wear_(price_of_renewal()) {
  const Part& part = positions.part();
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) layer_.push_back(part.model.points.layer[i]);
  check(KSPCreate(positions.comm(), krylov_.out()));
  check(KSPSetType(krylov_, KSPCG));
  check(KSPSetNormType(krylov_, KSP_NORM_NATURAL));
  check(KSPSetTolerances(krylov_, 1e-3, 0.0, PETSC_DEFAULT, 500));
  choose_preconditioner(preconditioner(), unknowns_, limit, hessian_.elliptic());
  check(KSPSetOperators(krylov_, hessian_.action(), hessian_.convex()));
  lend_preconditioner(krylov_);
  base::check_options(KSPSetFromOptions(krylov_));
}

PC TangentSolver::preconditioner() {
  PC pc = nullptr;
  check(KSPGetPC(krylov_, &pc));
  return pc;
}

void TangentSolver::lend_preconditioner(KSP other) {
  if (other != krylov_) check(KSPSetPC(other, preconditioner()));
  check(KSPSetResidualHistory(other, nullptr, PETSC_DECIDE, PETSC_TRUE));
  check(KSPSetPostSolve(other, after_solve, this));
}

PetscErrorCode TangentSolver::after_solve(KSP krylov, Vec, Vec, void* me) {
  try {
    static_cast<TangentSolver*>(me)->wear_.take(krylov);
  } catch (const std::exception&) {
    return PETSC_ERR_LIB;
  }
  return PETSC_SUCCESS;
}

void TangentSolver::prepare(Vec displacement) {
  hessian_.assemble(displacement);
  const bool moved = hessian_.assemblies() != made_at_;
  if (moved) wear_.move();
  const bool renew = renewals_ == 0 || hopeless() || (moved && wear_.out());
  check(PCSetReusePreconditioner(preconditioner(), renew ? PETSC_FALSE : PETSC_TRUE));
  if (renew) renew_preconditioner();
}

bool TangentSolver::hopeless() {
  return wear_.new_rate() > slowest && unknowns_ <= factors_limit && !given("-pc_type") &&
         is_hierarchy(preconditioner());
}

void TangentSolver::renew_preconditioner() {
  hessian_.renew();
  if (hopeless())
    choose_factors(preconditioner());
  else if (renewals_ == 0 && is_hierarchy(preconditioner()))
    make_hierarchy(preconditioner(), hessian_.convex(), layer_);
  wear_.renew();
  made_at_ = hessian_.assemblies();
  ++renewals_;
}

bool TangentSolver::solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance) {
  prepare(displacement);
  check(KSPSetOperators(krylov_, hessian_.action(), hessian_.convex()));
  check(KSPSetTolerances(krylov_, relative_tolerance, 0.0, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPSolve(krylov_, rhs, delta));
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(krylov_, &reason));
  if (reason == KSP_DIVERGED_PC_FAILED || reason == KSP_DIVERGED_NANORINF)
    throw base::InternalError("the preconditioner of the stiffness matrix could not be made");
  return reason != KSP_DIVERGED_INDEFINITE_MAT && reason != KSP_DIVERGED_INDEFINITE_PC;
}

double TangentSolver::newton_distance(Vec displacement, Vec gradient) {
  hessian_.assemble(displacement);
  PetscBool same = PETSC_FALSE;  // asked again at the same state
  if (measured_at_ == hessian_.assemblies()) check(VecEqual(gradient, measured_, &same));
  if (same) return distance_;
  check(VecSet(work_, 0));
  const bool convex = solve(displacement, gradient, work_, 0.05);
  distance_ = convex ? largest_block(work_) : std::numeric_limits<double>::infinity();
  measured_at_ = hessian_.assemblies();
  check(VecCopy(gradient, measured_));
  return distance_;
}

}  // namespace repose::solve
