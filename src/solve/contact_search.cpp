#include "contact_search.h"

#include <utility>

namespace repose::solve {

using base::check;

ContactSearch::ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                             linear::TangentSolver& solver, Minimizer& minimizer,
                             Minimizer::Watch watch)
    : objective_(objective),
      tangent_(tangent),
      programs_(objective, tangent, solver, std::move(watch)),
      descent_(objective, tangent, minimizer, programs_),
      other_(objective, tangent, programs_, descent_) {}

std::optional<bool> ContactSearch::predict(Vec displacement, double load, Vec increment) {
  objective_.contact().bodies().restore_released();
  const discrete::ContactPressures before = objective_.contact().multipliers();
  predicted_ = true;
  descent_.stiffen(1);
  const bool found = programs_.predict(displacement, load, increment);
  tangent_.forget_contact();
  if (!found) {
    objective_.contact().round_edges(false);
    tangent_.change_contact().set_multipliers(before);
  }
  return found;
}

Outcome ContactSearch::run(Vec displacement, double accuracy) {
  Outcome outcome;
  other_.begin(displacement);
  if (!std::exchange(predicted_, false)) {
    outcome = descent_.finish(displacement, chosen_to);
    if (outcome.converged) return end(displacement, accuracy, std::move(outcome));
  }
  int64_t iterations = 0;
  descent_.stiffen(1);
  if (descent_.approach(displacement, iterations) == End::stopped)
    return descent_.stopped(displacement, outcome);
  outcome = descent_.settle(displacement, chosen_to, most_rounds, false);
  outcome.iterations += iterations;
  return end(displacement, accuracy, std::move(outcome));
}

Outcome ContactSearch::run_near(Vec displacement, double accuracy) {
  const base::VecHandle guess = objective_.positions().make_vector();
  check(VecCopy(displacement, guess));
  other_.begin(displacement);
  objective_.contact().bodies().restore_released();
  const discrete::ContactPressures given = objective_.contact().multipliers();
  int64_t iterations = 0;
  // The search that ended here may have needed a stiffer penalty than the model's.
  for (const int times : {1, 8}) {
    descent_.stiffen(times);
    const End end_of_programs = programs_.run(displacement, chosen_to, iterations);
    if (end_of_programs == End::stopped) return descent_.stopped(displacement);
    if (end_of_programs == End::reached) {
      Outcome outcome = descent_.finish_reached(displacement, chosen_to, iterations);
      outcome.iterations += iterations;
      if (outcome.converged) return end(displacement, accuracy, std::move(outcome));
    }
    tangent_.change_contact().set_multipliers(given);
    check(VecCopy(guess, displacement));
  }
  tangent_.change_contact().set_multipliers({});
  Outcome outcome = run(displacement, accuracy);
  outcome.iterations += iterations;
  return outcome;
}

/// Ends a search to chosen_to: accepts what is within the accuracy, and leads it on to a finer one
/// unless find_other() will. Collective.
Outcome ContactSearch::end(Vec displacement, double accuracy, Outcome outcome) {
  if (outcome.stopped) return outcome;
  if (!outcome.converged && accuracy > chosen_to)
    outcome = continued(std::move(outcome), descent_.finish(displacement, accuracy));
  if (!finds_other_ || objective_.positions().load() < 1)
    outcome = descent_.refine(displacement, accuracy, std::move(outcome));
  return outcome;
}

void ContactSearch::find_other(Vec displacement, double accuracy, Outcome& outcome) {
  if (finds_other_) other_.find(displacement, accuracy, outcome);
}

}  // namespace repose::solve
