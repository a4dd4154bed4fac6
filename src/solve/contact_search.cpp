#include "contact_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "leave_saddle.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"

namespace repose::solve {

using base::check;

ContactSearch::ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                             linear::TangentSolver& solver, Minimizer& minimizer,
                             Minimizer::Watch watch)
    : objective_(objective),
      tangent_(tangent),
      solver_(solver),
      penalty_(objective, tangent),
      programs_(objective, tangent, solver, std::move(watch)),
      descent_(objective, tangent, minimizer, penalty_, programs_),
      other_(objective, tangent, penalty_, programs_, descent_,
             [this](Vec displacement, double accuracy) {
               return settle_touching_all(displacement, accuracy);
             }) {}

std::optional<bool> ContactSearch::predict(Vec displacement, double load, Vec increment) {
  objective_.contact().bodies().restore_released();
  const ContactPressures before = penalty_.multipliers();
  predicted_ = true;
  descent_.stiffen(1);
  const bool found = programs_.predict(displacement, load, increment);
  tangent_.forget_contact();
  if (!found) {
    objective_.contact().round_bodies(false);
    penalty_.set_multipliers(before);
  }
  return found;
}

/// Releases points between bodies that overlap from one of them. Returns true if there are any.
/// Collective.
bool ContactSearch::release_overlapped(double accuracy) {
  discrete::Positions& positions = objective_.positions();
  mechanics::BodyContact& contact = objective_.contact().bodies();
  contact.update_gaps(positions.local());
  const bool any = base::on_any_rank(positions.comm(), contact.release_overlapped(accuracy));
  if (any) tangent_.forget_contact();
  return any;
}

/// Leads points between bodies that overlap out round an edge of one of them. Returns true if there
/// are any that have such a way. Collective.
bool ContactSearch::lead_out(Vec displacement, double accuracy) {
  discrete::Positions& positions = objective_.positions();
  programs_.evaluate(displacement);
  programs_.linearize(displacement);
  const auto ways = objective_.contact().bodies().ways_out(positions.local(), accuracy);
  if (!base::on_any_rank(positions.comm(), !ways.empty())) return false;
  const bool found = programs_.step_with(ways, displacement);
  tangent_.forget_contact();
  return found;
}

Outcome ContactSearch::stopped(Vec displacement, Outcome outcome) {
  outcome.converged = false;
  outcome.stopped = true;
  outcome.reason = stopped_reason;
  outcome.stable = !programs_.reduced();
  outcome.displacement_error = std::numeric_limits<double>::infinity();
  outcome.objective = programs_.evaluate(displacement);
  outcome.gradient_max = programs_.largest_force();
  return outcome;
}

/// Leaves a saddle, unless its value is no less than that of the `latest` one, to which the search
/// may have returned. Collective.
bool ContactSearch::leave_lower_saddle(Vec displacement, double& latest) {
  constexpr double lower = 1e-6;  // of the value
  tangent_.forget_contact();
  const double value = programs_.evaluate(displacement);
  if (!(value < latest - lower * std::abs(value))) return false;
  latest = value;
  return leave_saddle(objective_, solver_, displacement);
}

/// Searches for another rest position where one at load 1 is found. Collective.
Outcome ContactSearch::with_other(Vec displacement, double accuracy, Outcome outcome) {
  outcome.overlapped = base::sum_over_ranks(objective_.positions().comm(),
                                            objective_.contact().bodies().count_released());
  if (finds_other_ && outcome.converged && outcome.overlapped == 0 &&
      objective_.positions().load() == 1)
    other_.find(displacement, accuracy, outcome);
  return outcome;
}

/// Ends at rest by rounds of programs from a position near it: after a soft search where they do
/// not reach it, with a stiffer penalty in each round. Collective.
Outcome ContactSearch::settle(Vec displacement, double accuracy, int max_rounds,
                              bool needs_presolve) {
  constexpr int max_left = 20, stiffest = 16;
  constexpr double steady = 0.98;  // ratio of the gaps that rounds leave where nothing closes them
  constexpr double none = std::numeric_limits<double>::infinity();
  Outcome outcome;
  int64_t iterations = 0;
  int times = 1, left = 0;  // stiffness of the penalty; saddles
  double saddle = none;     // value at the latest of them
  bool led_out = false;
  double missing = none;  // mm of gaps
  const auto leaves = [&] {
    needs_presolve = false;
    return left++ < max_left && leave_lower_saddle(displacement, saddle);
  };
  descent_.stiffen(times);
  for (int round = 0; round < max_rounds;) {
    if (needs_presolve) {
      const Outcome near = descent_.presolve(displacement, accuracy);
      iterations += near.iterations;
      if (near.stopped) return stopped(displacement, outcome);
    }
    const End end = programs_.run(displacement, accuracy, iterations);
    if (end == End::stopped) return stopped(displacement, outcome);
    if (end == End::failed && programs_.reduced() && leaves()) continue;
    outcome = end == End::reached ? descent_.finish_reached(displacement, accuracy, iterations)
                                  : descent_.finish(displacement, accuracy);
    if (outcome.converged) break;
    if (!outcome.stable && leaves()) continue;
    const double before = std::exchange(missing, penalty_.violation());
    if (missing > steady * before) {
      const bool leads = !std::exchange(led_out, true) && lead_out(displacement, accuracy);
      if (leads || release_overlapped(accuracy)) {
        missing = none;
        needs_presolve = !leads;
        continue;
      }
    }
    needs_presolve = end != End::reached;
    descent_.stiffen(times = std::min(2 * times, stiffest));
    ++round;
  }
  outcome.iterations += iterations;
  return outcome;
}

/// Settles without points that are released from a body: these have less energy than the rest
/// position that it is to be compared with. Collective.
Outcome ContactSearch::settle_touching_all(Vec displacement, double accuracy) {
  constexpr int max_rounds = 4;
  const int times = descent_.times();
  Outcome outcome = settle(displacement, accuracy, max_rounds, true);
  descent_.stiffen(times);
  mechanics::BodyContact& contact = objective_.contact().bodies();
  if (base::on_any_rank(objective_.positions().comm(), contact.count_released() > 0)) {
    contact.restore_released();
    outcome.converged = false;
  }
  return outcome;
}

Outcome ContactSearch::run(Vec displacement, double accuracy) {
  constexpr int max_rounds = 8;
  Outcome outcome;
  other_.begin(displacement);
  if (!std::exchange(predicted_, false)) {
    outcome = descent_.finish(displacement, accuracy);
    if (outcome.converged) return with_other(displacement, accuracy, std::move(outcome));
  }
  int64_t iterations = 0;
  descent_.stiffen(1);
  if (descent_.approach(displacement, accuracy, iterations) == End::stopped)
    return stopped(displacement, outcome);
  outcome = settle(displacement, accuracy, max_rounds, false);
  outcome.iterations += iterations;
  if (outcome.stopped) return outcome;
  if (!outcome.converged && outcome.displacement_error > accuracy)
    outcome.reason =
        fmt::format("contact did not converge: {:.3g} mm of gaps remain", penalty_.violation());
  return with_other(displacement, accuracy, std::move(outcome));
}

Outcome ContactSearch::run_near(Vec displacement, double accuracy) {
  const base::VecHandle guess = objective_.positions().make_vector();
  check(VecCopy(displacement, guess));
  other_.begin(displacement);
  objective_.contact().bodies().restore_released();
  descent_.stiffen(1);
  int64_t iterations = 0;
  const End end = programs_.run(displacement, accuracy, iterations);
  if (end == End::stopped) return stopped(displacement, {});
  if (end == End::reached) {
    Outcome outcome = descent_.finish_reached(displacement, accuracy, iterations);
    outcome.iterations += iterations;
    if (outcome.converged) return with_other(displacement, accuracy, std::move(outcome));
  }
  penalty_.set_multipliers({});
  check(VecCopy(guess, displacement));
  Outcome outcome = run(displacement, accuracy);
  outcome.iterations += iterations;
  return outcome;
}

}  // namespace repose::solve
