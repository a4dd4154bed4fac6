#include "repose/linear/energy_test.h"

#include <utility>

namespace repose::linear {

using base::check;

EnergyTest::EnergyTest(KSP krylov) : krylov_(krylov), replaces_(base::has_type(krylov, KSPCG)) {
  if (!replaces_) return;
  check(KSPGetNormType(krylov, &norm_));
  check(KSPGetAndClearConvergenceTest(krylov, &test_, &context_, &destroy_));
  check(KSPSetNormType(krylov, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetConvergenceTest(krylov, ends, this, nullptr));
}

EnergyTest::~EnergyTest() {
  if (!replaces_) return;
  static_cast<void>(KSPSetNormType(krylov_, norm_));
  static_cast<void>(KSPSetConvergenceTest(krylov_, test_, context_, destroy_));
}

PetscErrorCode EnergyTest::ends(KSP krylov, PetscInt iteration, PetscReal norm,
                                KSPConvergedReason* reason, void* me) {
  return base::run_callback([&] {
    auto& self = *static_cast<EnergyTest*>(me);
    Vec x = nullptr, b = nullptr, residual = nullptr;
    check(KSPGetSolution(krylov, &x));
    check(KSPGetRhs(krylov, &b));
    if (!self.sum_) check(VecDuplicate(b, self.sum_.out()));
    check(KSPBuildResidual(krylov, nullptr, self.sum_, &residual));
    check(VecAXPY(residual, 1.0, b));
    PetscReal lowered = 0, share = 0;
    check(VecDot(residual, x, &lowered));
    check(KSPGetTolerances(krylov, &share, nullptr, nullptr, nullptr));
    const double before = std::exchange(self.lowered_, lowered);
    const bool small = iteration > 0 && !(lowered - before > share * lowered);
    *reason = norm == 0 ? KSP_CONVERGED_ATOL : small ? KSP_CONVERGED_RTOL : KSP_CONVERGED_ITERATING;
  });
}

}  // namespace repose::linear
