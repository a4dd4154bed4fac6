#include "repose/solve/force_search.h"

#include <algorithm>

namespace repose::solve {

using base::check;

ForceSearch::ForceSearch(discrete::ForceFunctional& functional, Minimizer& minimizer)
    : functional_(functional),
      minimizer_(minimizer),
      before_(functional.positions().make_vector()),
      nearest_(functional.positions().make_vector()) {}

Outcome ForceSearch::run(Vec displacement, double accuracy) {
  constexpr int max_stages = 10;
  constexpr double shrink = 0.1, minimum = 1e-6;  // of ε, at each stage and N at last
  constexpr double fine = 0.1;                    // mm, of estimates that rounding limits
  const bool same_minimum = functional_.weights().volume == mechanics::VolumeTerm::none;
  double epsilon = std::max(functional_.largest_force(displacement), minimum);
  Outcome outcome, nearest;
  double nearest_epsilon = epsilon;
  int64_t iterations = 0;
  for (int stage = 0; stage < max_stages; ++stage, epsilon *= shrink) {
    functional_.set_epsilon(epsilon);
    check(VecCopy(displacement, before_));
    outcome = minimizer_.run(displacement, accuracy);
    iterations += outcome.iterations;
    if (outcome.stopped) outcome.converged = outcome.converged && same_minimum;
    if (outcome.stopped || (outcome.converged && same_minimum)) break;
    check(VecAXPY(before_, -1, displacement));
    const double moved = discrete::largest_block(before_);
    if (stage > 0) outcome.displacement_error += moved;
    outcome.converged = stage > 0 && outcome.displacement_error <= accuracy;
    if (outcome.converged) break;
    if (!same_minimum)
      outcome.reason = "the minimum still moves as the smoothing of the forces goes down";
    // At the smallest ε rounding keeps the estimate from getting better.
    if (stage > 1 && !(outcome.displacement_error < nearest.displacement_error)) continue;
    nearest = outcome;
    nearest_epsilon = epsilon;
    check(VecCopy(displacement, nearest_));
  }
  if (!outcome.converged && !outcome.stopped) {
    outcome = nearest;
    outcome.too_fine = !same_minimum && outcome.displacement_error < fine;
    functional_.set_epsilon(nearest_epsilon);
    check(VecCopy(nearest_, displacement));
  }
  outcome.iterations = iterations;
  return outcome;
}

}  // namespace repose::solve
