#include "contact_search.h"

#include <utility>

namespace repose::solve {

using base::check;

namespace {

/// mm, to which a rest position is chosen whatever the accuracy: on which side of an edge a point
/// rests depends on this.
constexpr double chosen_to = 0.02;
constexpr int program_rounds = 8;

/// Puts the `next` outcome of a search in place of the one that it continues from.
void continue_with(Outcome next, Outcome& outcome) {
  next.iterations += outcome.iterations;
  next.other = std::move(outcome.other);
  outcome = std::move(next);
}

}  // namespace

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
  other_.begin(displacement);
  return choose(displacement, accuracy, search(displacement));
}

Outcome ContactSearch::run_near(Vec displacement, double accuracy) {
  other_.begin(displacement);
  return choose(displacement, accuracy, search_near(displacement));
}

/// Finds a rest position to chosen_to. Collective.
Outcome ContactSearch::search(Vec displacement) {
  Outcome outcome;
  if (!std::exchange(predicted_, false)) {
    outcome = descent_.finish(displacement, chosen_to);
    if (outcome.converged) return outcome;
  }
  int64_t iterations = 0;
  descent_.stiffen(1);
  if (descent_.approach(displacement, iterations) == End::stopped)
    return descent_.stopped(displacement, outcome);
  outcome = descent_.settle(displacement, chosen_to, program_rounds, false);
  outcome.iterations += iterations;
  return outcome;
}

/// Finds a rest position near a guess to chosen_to, by programs alone where they serve. Collective.
Outcome ContactSearch::search_near(Vec displacement) {
  const base::VecHandle guess = objective_.positions().make_vector();
  check(VecCopy(displacement, guess));
  objective_.contact().bodies().restore_released();
  descent_.stiffen(1);
  int64_t iterations = 0;
  const End end = programs_.run(displacement, chosen_to, iterations);
  if (end == End::stopped) return descent_.stopped(displacement);
  Outcome outcome;
  if (end == End::reached) {
    outcome = descent_.finish_reached(displacement, chosen_to, iterations);
    outcome.iterations += iterations;
    if (outcome.converged) return outcome;
  }
  tangent_.change_contact().set_multipliers({});
  check(VecCopy(guess, displacement));
  outcome = search(displacement);
  outcome.iterations += iterations;
  return outcome;
}

/// Takes the rest position of least energy that is found at load 1, and leads it to an accuracy.
/// Collective.
Outcome ContactSearch::choose(Vec displacement, double accuracy, Outcome outcome) {
  if (outcome.stopped) return outcome;
  if (!outcome.converged && accuracy > chosen_to)
    continue_with(descent_.finish(displacement, accuracy), outcome);
  if (finds_other_ && objective_.positions().load() == 1)
    other_.find(displacement, chosen_to, outcome);
  if (outcome.converged && outcome.displacement_error > accuracy)
    continue_with(descent_.settle(displacement, accuracy, program_rounds, false), outcome);
  if (outcome.other && outcome.other->distance <= 2 * accuracy) outcome.other.reset();
  if (!outcome.converged && (outcome.stable || outcome.displacement_error > accuracy))
    outcome.reason = fmt::format("contact did not converge: {:.3g} mm of gaps remain",
                                 objective_.contact().violation());
  return outcome;
}

}  // namespace repose::solve
