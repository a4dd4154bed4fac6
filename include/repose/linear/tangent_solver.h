#pragma once
#include "repose/linear/preconditioner.h"

namespace repose::linear {

using KspHandle = base::Handle<KSP, KSPDestroy>;

/// Linear solves with a Hessian: conjugate gradients on the exact action, preconditioned from the
/// convex relative (preconditioner.h). `-ksp_…` options apply; of `-ksp_rtol` and the tolerance
/// that a solve requests, the smaller one. All members collective.
class TangentSolver {
 public:
  TangentSolver(discrete::Positions& positions, discrete::Hessian& hessian);

  /// Takes the Hessian to `displacement`, and renews the preconditioner there if it is worn out.
  void prepare(Vec displacement);
  /// Takes the Hessian to `displacement` and makes the preconditioner there, unless it was made
  /// there.
  void renew(Vec displacement);
  /// Takes the Hessian to `displacement`, and of the preconditioner the contact alone.
  void refresh(Vec displacement);

  /// Goes back to the state after construction.
  void reset();
  /// Makes a preconditioner at `displacement`, whatever was solved before, to which restore() goes
  /// back; null where it is not multigrid.
  std::shared_ptr<const KeptPreconditioner> make_kept(Vec displacement);
  void restore(const KeptPreconditioner& kept);

  /// Solves H δ = rhs at `displacement` (prepared there), to a relative natural residual. Returns
  /// whether the Hessian showed no negative curvature on the way; where it did, or iterations ran
  /// out, δ is the iterate reached.
  bool solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance);
  bool finished() const { return finished_; }  ///< the latest solve, to the tolerance requested
  /// H δ of the latest solve, whose right-hand side is `rhs`: what the residual leaves of it.
  void product_of_solution(Vec rhs, Vec product);

  discrete::Positions& positions() { return positions_; }
  discrete::Hessian& hessian() { return hessian_; }
  HessianPreconditioner& preconditioner() { return preconditioner_; }
  KSP krylov() const { return krylov_; }

 private:
  void make_krylov();
  /// Says why no linear system can be solved. Collective.
  [[noreturn]] void throw_unsolvable();

  discrete::Positions& positions_;
  discrete::Hessian& hessian_;
  HessianPreconditioner preconditioner_;
  KspHandle krylov_;
  base::VecHandle residual_;
  PetscReal most_left_ = 1;  // -ksp_rtol
  bool finished_ = false;
};

/// Solves with conjugate gradients, as long as it lives, where the preconditioner alone is chosen
/// (`-ksp_type preonly`), which bounds no residual.
class CgInPlaceOfPreonly {
 public:
  explicit CgInPlaceOfPreonly(KSP krylov);
  ~CgInPlaceOfPreonly();
  CgInPlaceOfPreonly(CgInPlaceOfPreonly&&) = delete;
  bool replaced() const { return replaced_; }

 private:
  KSP krylov_;
  bool replaced_;
};

}  // namespace repose::linear
