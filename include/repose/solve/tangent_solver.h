#pragma once
#include <petscksp.h>

#include <limits>

#include "repose/solve/function.h"

namespace repose::solve {

using KspHandle = base::Handle<KSP, KSPDestroy>;

/// Linear solves with a Hessian: conjugate gradients on the exact matrix,
/// preconditioned from the convex one, by default by MUMPS' Cholesky factors up to
/// `direct_limit` unknowns and by smoothed-aggregation multigrid (GAMG) above. `-ksp_…` and
/// `-pc_…` options apply. All members collective.
class TangentSolver {
 public:
  static constexpr int64_t direct_limit = 600000;  ///< scalar unknowns

  TangentSolver(Positions& positions, Hessian& hessian);

  /// Solves H δ = rhs at `displacement` (assembled there, factors renewed if it moved), to a
  /// relative natural residual. Returns whether the Hessian showed no negative curvature on the
  /// way; where it did, δ is the iterate reached.
  bool solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance);

  /// The Newton step −H⁻¹ ∇Φ at `displacement`, its largest block in mm: how far the rest position
  /// is in a quadratic model. Infinite where H is not positive definite along the solve.
  double newton_distance(Vec displacement, Vec gradient);

  /// H⁻¹ ∇Φ of the last newton_distance.
  Vec latest() const { return work_; }

  Hessian& hessian() { return hessian_; }
  PC preconditioner();
  KSP krylov() const { return krylov_; }

 private:
  Hessian& hessian_;
  KspHandle krylov_;
  base::VecHandle work_;
};

}  // namespace repose::solve
