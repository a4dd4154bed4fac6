#pragma once
#include <optional>

#include "repose/discrete/force_functional.h"
#include "repose/discrete/tangent.h"
#include "repose/solve/minimizer.h"

namespace repose::solve {

/// The function that is minimized with its derivatives and linear solvers, one object so that they
/// live and end together: f_e + W with a volume term, or the force functional.
class Problem {
 public:
  Problem(discrete::Positions& positions, const mechanics::Weights& weights,
          bool force);  ///< collective

  /// Takes contact, Hessian and linear solvers back to the state after construction. Collective.
  void reset();
  discrete::Function& function();
  linear::TangentSolver& solver();  ///< of function()
  ErrorEstimate error_estimate();   ///< whose Newton step estimates the distance from rest best

  discrete::Objective& objective() {
    return objective_;
  }                                                  ///< f_e + W alone where forces are minimized
  discrete::Tangent& tangent() { return tangent_; }  ///< of objective()
  linear::TangentSolver& elastic_solver() { return elastic_solver_; }  ///< of objective()
  discrete::ForceFunctional* force() {
    return force_ ? &*force_ : nullptr;
  }  ///< null for an energy
  int64_t assemblies() const;

 private:
  discrete::Objective objective_;
  discrete::Tangent tangent_;
  linear::TangentSolver elastic_solver_;
  std::optional<discrete::ForceFunctional> force_;
  std::optional<discrete::ForceHessian> force_hessian_;
  std::optional<linear::TangentSolver> force_solver_;
};

}  // namespace repose::solve
