#pragma once
#include <petscksp.h>

#include <limits>
#include <memory>

#include "repose/linear/column_multigrid.h"
#include "repose/linear/lag_policy.h"

namespace repose::linear {

/// A preconditioner and what has been found out with it.
struct KeptPreconditioner;

using KspHandle = base::Handle<KSP, KSPDestroy>;
using PcHandle = base::Handle<PC, PCDestroy>;

/// Linear solves with a Hessian: conjugate gradients on the exact action, preconditioned from the
/// convex relative, by default by multigrid on columns (`-pc_type columns`, column_multigrid.h);
/// falls back to MUMPS' Cholesky factors when it stagnates; these also serve where
/// multigrid does not work, up to `factors_limit` unknowns. A preconditioner made at one state
/// serves the next ones until it is worn out (lag_policy.h). `-ksp_…` and `-pc_…` options apply,
/// and `-pc_renewal_price`: the iterations that a preconditioner may cost before it is renewed. All
/// members collective.
class TangentSolver {
 public:
  static constexpr int64_t factors_limit = 600000;  ///< scalar unknowns

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

  /// Makes `other` use the preconditioner, whose lag its solves add to.
  void share_preconditioner(KSP other);

  /// Solves H δ = rhs at `displacement` (prepared there), to a relative natural residual. Returns
  /// whether the Hessian showed no negative curvature on the way; where it did, or iterations ran
  /// out, δ is the iterate reached.
  bool solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance);
  bool finished() const { return finished_; }  ///< the latest solve, to the tolerance requested
  /// H δ of the latest solve, whose right-hand side is `rhs`: what the residual leaves of it.
  void product_of_solution(Vec rhs, Vec product);

  /// The Newton step −H⁻¹ ∇Φ at `displacement`, its largest block in mm: how far the rest position
  /// is in a quadratic model. Infinite where H is not positive definite along the solve.
  double newton_distance(Vec displacement, Vec gradient);

  /// newton_distance that holds wherever stiffnesses lie far apart: conjugate gradients bound the
  /// error e of the step in the energy norm, in which soft points hardly count; no point is off by
  /// more than √(c eᵀHe), c its compliance. So the step is solved for until that is little of it,
  /// or below `slack`, mm. Infinite where that is out of reach, or a random load meets negative
  /// curvature.
  double error_bound(Vec displacement, Vec gradient, double slack);
  /// Returns whether a random load meets no negative curvature: a balanced state may be a saddle.
  bool is_minimum(Vec displacement);
  /// Returns whether the latest distance, or the random load that bounded it, met any.
  bool negative_curvature() const { return negative_curvature_ || !convex_; }
  double error_slack() const {
    return error_slack_;
  }  ///< mm, of the latest, where it is not little of it

  /// Estimates newton_distance by the preconditioner alone; 0 where there is none
  /// yet.
  double preconditioned_step(Vec gradient);

  /// Ratio to the latest newton_distance, at `displacement`, of the Newton step from its
  /// end `trial`, where the gradient is given: by the largest block or by the energy norm
  /// √(∇Φᵀ H⁻¹ ∇Φ), whichever falls less. Infinite where the model that the step is of misleads: H
  /// is not positive definite at its end, or the slope along it is not even halved there.
  double contraction(Vec displacement, Vec trial, Vec gradient);

  /// H⁻¹ ∇Φ of the last newton_distance.
  Vec newton_step() const { return work_; }

  discrete::Hessian& hessian() { return hessian_; }
  PC preconditioner();
  /// Returns the matrix that the preconditioner is made from.
  Mat preconditioner_matrix();
  /// Rebuilds the preconditioner, at the state of the Hessian's last assembly.
  void renew_preconditioner();
  /// Takes the Hessian's present contact into the preconditioner, where that is multigrid.
  void update_contact();
  bool by_factors() const { return factors_ != nullptr; }  ///< the direct fallback is in use
  int64_t renewals() const { return renewals_; }           ///< of the preconditioner

 private:
  static PetscErrorCode after_solve(KSP krylov, Vec rhs, Vec solution, void* me);
  static PetscErrorCode apply_columns(PC pc, Vec r, Vec z);
  void make_krylov();
  void choose_preconditioner();
  bool use_direct_fallback() const;
  /// Says why no linear system can be solved. Collective.
  [[noreturn]] void throw_unsolvable();
  double largest_compliance(Vec displacement);
  /// Returns whether δ reduces the residual: the norm that a solve ends by is that of the
  /// preconditioner, which says little where stiffnesses lie far apart.
  bool residual_decreased(Vec rhs, Vec delta);
  /// Reduces the residual of the latest Newton step by a factor; returns whether it succeeded.
  bool refine(Vec displacement, Vec gradient, double factor);
  void renew_columns();

  double error_slack_ = 0;
  static constexpr double usual_ = 0.05;  // to which Newton steps are solved for

  discrete::Positions& positions_;
  discrete::Hessian& hessian_;
  int64_t unknowns_;  // scalar, of all ranks
  std::shared_ptr<ColumnMultigrid> columns_;
  PcHandle factors_;  // in the place of columns_
  KspHandle krylov_;
  base::VecHandle next_;             // the Newton step at a trial
  base::VecHandle work_, measured_;  // the latest Newton step and the gradient it is of
  double distance_ = 0;              // its length, …
  int64_t measured_at_ = -1;         // … at this many assemblies of the Hessian
  int64_t bounded_at_ = -1;          // and at this many it is sure
  double compliance_ = 0;            // mm/N, of the softest point, by a random load, …
  bool convex_ = true;               // … which met no negative curvature, …
  int64_t loaded_at_ = -1;           // … at this many assemblies of the Hessian
  bool negative_curvature_ = false;  // the latest Newton step met some
  bool finished_ = false;
  LagPolicy lag_;
  int64_t renewals_ = 0;
  int64_t made_at_ = -1, made_at_state_ = -1;  // assemblies and states at the last renewal
};

}  // namespace repose::linear
