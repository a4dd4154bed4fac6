#pragma once
#include <petscksp.h>

#include "repose/base/petsc.h"

namespace repose::linear {

/// Ends solves by conjugate gradients, as long as it lives, where an iteration lowers the energy
/// ½ xᵀAx − bᵀx by less than the relative tolerance of what all of them have (Hestenes & Stiefel
/// 1952; Strakoš & Tichý 2002). The natural residual costs an application of the preconditioner
/// after the last iteration, where this costs none. Does nothing to other methods. All members
/// collective.
class EnergyTest {
 public:
  explicit EnergyTest(KSP krylov);
  ~EnergyTest();
  EnergyTest(EnergyTest&&) = delete;

 private:
  using Test = PetscErrorCode (*)(KSP, PetscInt, PetscReal, KSPConvergedReason*, void*);
  using Destroy = PetscErrorCode (*)(void*);
  static PetscErrorCode ends(KSP krylov, PetscInt iteration, PetscReal norm,
                             KSPConvergedReason* reason, void* me);

  KSP krylov_;
  bool replaces_;
  base::VecHandle sum_;    // of the residual and the right-hand side
  PetscReal lowered_ = 0;  // twice the energy, so far
  Test test_ = nullptr;    // that it stands in for, with its norm
  void* context_ = nullptr;
  Destroy destroy_ = nullptr;
  KSPNormType norm_ = KSP_NORM_DEFAULT;
};

}  // namespace repose::linear
