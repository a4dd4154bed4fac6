#include "repose/linear/lag_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/base/petsc.h"

namespace repose::linear {

using base::check;

void LagPolicy::renew() {
  new_ = true;
  spent_ = new_iterations_ = folds_ = 0;
}

void LagPolicy::move() { new_ = false; }

void LagPolicy::observe(KSP krylov) {
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(krylov, &reason));
  constexpr double endless = std::numeric_limits<double>::infinity();
  const bool indefinite = reason == KSP_DIVERGED_INDEFINITE_PC;
  const bool failed = indefinite || reason == KSP_DIVERGED_ITS;
  // Cut short by the trust region or negative curvature, whose measure is the preconditioner's: an
  // old one then leads astray, in a number of Newton steps that no count of iterations tells.
  const bool cut = reason > 0 && reason != KSP_CONVERGED_RTOL && reason != KSP_CONVERGED_ATOL;
  if ((failed || cut) && !new_) spent_ = endless;
  if (indefinite && new_) new_iterations_ = endless;
  const PetscReal* norm = nullptr;
  PetscInt norms = 0;
  check(KSPGetResidualHistory(krylov, &norm, &norms));
  if (norms < 2 || !(norm[norms - 1] > 0) || cut) return;
  const double folds = std::max(0.0, std::log(norm[0] / norm[norms - 1]));
  if (folds == 0 && !failed) return;
  const auto iterations = static_cast<double>(norms - 1);
  if (new_) {
    new_iterations_ += iterations;
    folds_ += folds;
  } else {
    spent_ += std::max(0.0, iterations - new_rate() * folds);
  }
}

}  // namespace repose::linear
