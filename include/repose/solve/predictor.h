#pragma once
#include "repose/discrete/objective.h"
#include "repose/linear/tangent_solver.h"

namespace repose::solve {

/// How the unknowns move, to first order, when the fixed points go on: −H⁻¹ H_sb Δx_b.
class Predictor {
 public:
  Predictor(discrete::Objective& objective, linear::TangentSolver& solver);

  /// The increment from `displacement` at the positions' load to `load`. Returns false where the
  /// Hessian is indefinite or the linear solver comes to no end. Collective.
  bool predict(Vec displacement, double load, Vec increment);

 private:
  discrete::Objective& objective_;
  linear::TangentSolver& solver_;
  base::VecHandle force_;
};

}  // namespace repose::solve
