#pragma once
#include "repose/discrete/force_functional.h"
#include "repose/solve/minimizer.h"

namespace repose::solve {

/// Finds the rest position as the minimum of the force functional, whose smoothing ε goes down
/// towards zero. Without volume term every ε has the same minimum, F = 0. Where none is within the
/// accuracy, the state with the smallest estimate is returned.
class ForceSearch : public RestSearch {
 public:
  ForceSearch(discrete::ForceFunctional& functional, Minimizer& minimizer);
  Outcome run(Vec displacement, double accuracy) override;

 private:
  discrete::ForceFunctional& functional_;
  Minimizer& minimizer_;
  base::VecHandle before_, nearest_;
};

}  // namespace repose::solve
