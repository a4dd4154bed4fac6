#pragma once
#include "contact_gaps.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/energy_test.h"
#include "repose/linear/tangent_solver.h"

namespace repose::solve {

/// The quadratic program of a step of contact: minimizes ½ dᵀHd + bᵀd over d with
/// g + Σ ∇g · d ≥ 0 at every gap that is near, = 0 where a point slides (docs/theory/contact.md).
/// H is the exact Hessian of the tissue and the curvature −a p ∂²g of the gaps' multipliers. An
/// augmented Lagrangian on an active set: each linear solve, by the tangent solver, is followed by
/// a new set and new multipliers.
class ContactQp {
 public:
  ContactQp(discrete::Objective& objective, discrete::Tangent& tangent,
            linear::TangentSolver& solver);

  ContactGaps& gaps() { return gaps_; }

  /// Minimizes; `slope` is b, `step` receives d, the objective the multipliers. Stops where a
  /// further set would change d and the gaps by less than `tolerance` mm, or less than a tenth of
  /// d's largest 3-vector. Where negative curvature is met, the gaps' curvature is reduced, to its
  /// semidefinite part in the end. Returns whether a minimum was reached. Collective.
  bool solve(Vec displacement, Vec slope, double tolerance, Vec step);
  /// Returns whether the latest solve met negative curvature.
  bool reduced() const { return reduced_; }

 private:
  void set_blocks();
  bool minimize(Vec displacement, Vec slope, double tolerance, Vec step);
  bool search(Vec displacement, Vec slope, double tolerance, Vec step);

  ContactGaps gaps_;
  discrete::Tangent& tangent_;
  linear::TangentSolver& solver_;
  bool reduced_ = false;
  base::VecHandle force_, left_, direction_, change_;  // H d, −∇, δ, H δ
};

}  // namespace repose::solve
