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
  constexpr int max_rounds = 8;
  Outcome outcome;
  other_.begin(displacement);
  if (!std::exchange(predicted_, false)) {
    outcome = descent_.finish(displacement, accuracy);
    if (outcome.converged) return outcome;
  }
  int64_t iterations = 0;
  descent_.stiffen(1);
  if (descent_.approach(displacement, accuracy, iterations) == End::stopped)
    return descent_.stopped(displacement, outcome);
  outcome = descent_.settle(displacement, accuracy, max_rounds, false);
  outcome.iterations += iterations;
  if (outcome.stopped) return outcome;
  if (!outcome.converged && (outcome.stable || outcome.displacement_error > accuracy))
    outcome.reason = fmt::format("contact did not converge: {:.3g} mm of gaps remain",
                                 objective_.contact().violation());
  return outcome;
}

Outcome ContactSearch::run_near(Vec displacement, double accuracy) {
  const base::VecHandle guess = objective_.positions().make_vector();
  check(VecCopy(displacement, guess));
  other_.begin(displacement);
  objective_.contact().bodies().restore_released();
  descent_.stiffen(1);
  int64_t iterations = 0;
  const End end = programs_.run(displacement, accuracy, iterations);
  if (end == End::stopped) return descent_.stopped(displacement);
  if (end == End::reached) {
    Outcome outcome = descent_.finish_reached(displacement, accuracy, iterations);
    outcome.iterations += iterations;
    if (outcome.converged) return outcome;
  }
  tangent_.change_contact().set_multipliers({});
  check(VecCopy(guess, displacement));
  Outcome outcome = run(displacement, accuracy);
  outcome.iterations += iterations;
  return outcome;
}

void ContactSearch::find_other(Vec displacement, double accuracy, Outcome& outcome) {
  if (finds_other_) other_.find(displacement, accuracy, outcome);
}

}  // namespace repose::solve
