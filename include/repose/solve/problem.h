#pragma once
#include <optional>

#include "repose/solve/force_functional.h"
#include "repose/solve/minimiser.h"
#include "repose/solve/tangent.h"

namespace repose::solve {

/// The function that is minimised with its derivatives and linear solvers, one object so that they
/// live and end together: f_e + W with a volume term, or the force functional.
class Problem {
 public:
  Problem(Positions& positions, const mechanics::Weights& weights, bool force);  ///< collective

  Function& function();
  TangentSolver& solver();    ///< of function()
  Certificate certificate();  ///< whose Newton step tells the distance from rest best

  Objective& objective() { return objective_; }  ///< f_e + W alone where forces are minimised
  Tangent& tangent() { return tangent_; }        ///< of objective()
  TangentSolver& elastic_solver() { return elastic_solver_; }       ///< of objective()
  ForceFunctional* force() { return force_ ? &*force_ : nullptr; }  ///< null for an energy
  int64_t assemblies() const;

 private:
  Objective objective_;
  Tangent tangent_;
  TangentSolver elastic_solver_;
  std::optional<ForceFunctional> force_;
  std::optional<ForceHessian> force_hessian_;
  std::optional<TangentSolver> force_solver_;
};

}  // namespace repose::solve
