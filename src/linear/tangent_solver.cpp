#include "repose/linear/tangent_solver.h"

#include <algorithm>
#include <cmath>

#include "repose/base/petsc.h"

namespace repose::linear {

using base::check;

TangentSolver::TangentSolver(discrete::Positions& positions, discrete::Hessian& hessian)
    : positions_(positions),
      hessian_(hessian),
      preconditioner_(positions, hessian),
      residual_(positions.make_vector()) {
  make_krylov();
}

void TangentSolver::make_krylov() {
  constexpr double coarsest = 0.9;  // relative residual; no solve requests more
  check(KSPCreate(positions_.comm(), krylov_.out()));
  check(KSPSetType(krylov_, KSPCG));
  check(KSPSetNormType(krylov_, KSP_NORM_NATURAL));
  check(KSPSetTolerances(krylov_, coarsest, 0.0, PETSC_DEFAULT, 500));
  preconditioner_.attach(krylov_);
  base::check_options(KSPSetFromOptions(krylov_));
  if (base::has_type<KSP>(krylov_, KSPMINRES))  // has no natural norm
    check(KSPSetNormType(krylov_, KSP_NORM_PRECONDITIONED));
  check(KSPGetTolerances(krylov_, &most_left_, nullptr, nullptr, nullptr));
  check(KSPSetOperators(krylov_, hessian_.action(), preconditioner_.matrix()));
}

void TangentSolver::reset() {
  krylov_ = {};
  preconditioner_.reset();
  make_krylov();
  finished_ = false;
}

std::shared_ptr<const KeptPreconditioner> TangentSolver::make_kept(Vec displacement) {
  reset();
  renew(displacement);
  return preconditioner_.keep();
}

void TangentSolver::restore(const KeptPreconditioner& kept) {
  reset();
  preconditioner_.restore(kept);
}

void TangentSolver::prepare(Vec displacement) {
  hessian_.assemble(displacement);
  preconditioner_.renew_if_worn();
}

void TangentSolver::renew(Vec displacement) {
  hessian_.assemble(displacement);
  preconditioner_.renew();
}

void TangentSolver::refresh(Vec displacement) {
  hessian_.assemble(displacement);
  preconditioner_.update_contact();
}

void TangentSolver::throw_unsolvable() {
  hessian_.renew();
  const Mat matrix = hessian_.spd_approximation();
  const base::VecHandle diagonal = positions_.make_vector();
  PetscReal softest = 0, stiffest = 0, norm = 0;
  check(MatGetDiagonal(matrix, diagonal));
  check(VecMin(diagonal, nullptr, &softest));
  check(VecMax(diagonal, nullptr, &stiffest));
  check(MatNorm(matrix, NORM_FROBENIUS, &norm));
  if (!std::isfinite(norm)) discrete::refuse_overflow("stiffnesses", positions_.load());
  base::refuse(
      "stiffnesses of points at load {:.4g}, the largest {:.2g} times the smallest, lie too far "
      "apart for the preconditioner; bring the moduli of strata and regions nearer together",
      positions_.load(), stiffest / softest);
}

bool TangentSolver::solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance) {
  prepare(displacement);
  check(KSPSetOperators(krylov_, hessian_.action(), preconditioner_.matrix()));
  check(KSPSetTolerances(krylov_, std::min(relative_tolerance, most_left_), 0.0, PETSC_DEFAULT,
                         PETSC_DEFAULT));
  check(KSPSolve(krylov_, rhs, delta));
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(krylov_, &reason));
  if (reason == KSP_DIVERGED_PC_FAILED || reason == KSP_DIVERGED_NANORINF) throw_unsolvable();
  finished_ = reason > 0 && reason != KSP_CONVERGED_ITS;  // preonly asks for no accuracy
  // PETSc's conjugate gradients see the curvature change its sign, not that it has the wrong one.
  PetscReal product = 0;
  check(VecDot(rhs, delta, &product));
  return product >= 0 && reason != KSP_DIVERGED_INDEFINITE_MAT &&
         reason != KSP_DIVERGED_INDEFINITE_PC;
}

void TangentSolver::product_of_solution(Vec rhs, Vec product) {
  Vec left = nullptr;
  check(KSPBuildResidual(krylov_, nullptr, residual_, &left));
  check(VecWAXPY(product, -1.0, left, rhs));
}

CgInPlaceOfPreonly::CgInPlaceOfPreonly(KSP krylov)
    : krylov_(krylov), replaced_(base::has_type(krylov, KSPPREONLY)) {
  if (replaced_) check(KSPSetType(krylov_, KSPCG));
}

CgInPlaceOfPreonly::~CgInPlaceOfPreonly() {
  if (replaced_) static_cast<void>(KSPSetType(krylov_, KSPPREONLY));
}

}  // namespace repose::linear
