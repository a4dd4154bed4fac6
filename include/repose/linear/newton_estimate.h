#pragma once
#include "repose/linear/tangent_solver.h"

namespace repose::linear {

/// Estimates how far a rest position is by Newton steps −H⁻¹ ∇Φ, whose linear systems a solver
/// solves (docs/theory/error_estimate.md). What is known at a state is not computed again there.
/// All members collective.
class NewtonEstimate {
 public:
  explicit NewtonEstimate(TangentSolver& solver);

  /// Returns the largest block of the Newton step at `displacement`, mm: how far the rest position
  /// is in a quadratic model. Infinite where H is not positive definite along the solve.
  double distance(Vec displacement, Vec gradient);
  /// H⁻¹ ∇Φ of the latest distance().
  Vec step() const { return step_; }

  /// Returns a distance() that also holds where stiffnesses lie far apart, mm: conjugate gradients
  /// bound the error e of the step in the energy norm, in which soft points hardly count; no point
  /// is off by more than √(c eᵀHe), c its compliance. So the step is solved for until that is
  /// little of it, or below `slack`, mm. Infinite where that is out of reach, or a random load
  /// meets negative curvature.
  double bound(Vec displacement, Vec gradient, double slack);
  double error_slack() const { return error_slack_; }  ///< mm, of bound(), where not little of it

  /// Returns whether a random load meets no negative curvature: a balanced state may be a saddle.
  bool is_minimum(Vec displacement);
  /// Returns whether the latest distance, or the random load that bounded it, met any.
  bool negative_curvature() const { return negative_curvature_ || !random_load_.convex; }

  /// Estimates distance() by the preconditioner alone; 0 where there is none yet.
  double preconditioned_distance(Vec gradient);

  /// Ratio to the latest distance(), at `displacement`, of the Newton step from its end `trial`,
  /// where the gradient is given: by the largest block or by the energy norm √(∇Φᵀ H⁻¹ ∇Φ),
  /// whichever falls less. Infinite where the model that the step is of misleads: H is not positive
  /// definite at its end, or the slope along it is not even halved there.
  double contraction(Vec displacement, Vec trial, Vec gradient);

 private:
  /// Upper estimate of a point's compliance, mm/N, by a load of random signs. Soft points move
  /// most, and take most of its energy, so that a rough solution suffices.
  double largest_compliance(Vec displacement);
  /// Returns whether δ reduces the residual: the norm that a solve ends by is that of the
  /// preconditioner, which says little where stiffnesses lie far apart.
  bool residual_decreased(Vec rhs, Vec delta);
  /// Reduces the residual of the step by a factor; returns whether it succeeded.
  bool refine(Vec displacement, Vec gradient, double factor);

  static constexpr double usual_ = 0.05;  // to which steps are solved for

  TangentSolver& solver_;
  base::VecHandle step_, gradient_;  // the latest step and the gradient that it is of
  double distance_ = 0;              // mm, length of the latest step
  int64_t measured_at_ = -1;         // assemblies of the Hessian at the latest step, −1: none
  bool bounded_ = false;             // distance_ is that of bound()
  double error_slack_ = 0;
  bool negative_curvature_ = false;  // the latest step met some
  /// Response to a load of random signs.
  struct {
    double compliance = 0;  // mm/N, of the softest point
    bool convex = true;     // it met no negative curvature
    int64_t at = -1;        // assemblies of the Hessian
  } random_load_;
  base::VecHandle next_;  // the step at a trial
};

}  // namespace repose::linear
