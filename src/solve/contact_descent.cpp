#include "contact_descent.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "repose/base/collective.h"

namespace repose::solve {

namespace {

constexpr double missed = 0.25;       // of the accuracy, by contact
constexpr double contact_safety = 2;  // the estimate is so many times what is left

}  // namespace

ContactDescent::ContactDescent(discrete::Objective& objective, discrete::Tangent& tangent,
                               Minimizer& minimizer, ContactPrograms& programs)
    : objective_(objective),
      tangent_(tangent),
      minimizer_(minimizer),
      programs_(programs),
      stiffness_(objective_.positions().part().model.contact.stiffness) {}

void ContactDescent::stiffen(int times) {
  times_ = times;
  stiffness_ = times * objective_.positions().part().model.contact.stiffness;
  programs_.set_stiffness(stiffness_);
  tangent_.change_contact().set_stiffness(stiffness_);
}

/// Softens the penalty, which lets points change sides a few at a time.
void ContactDescent::soften() {
  constexpr double softened = 0.25;
  tangent_.change_contact().set_stiffness(softened * stiffness_);
}

/// Takes the pressures of a soft search that ended at `displacement` as multipliers, at the full
/// stiffness again.
void ContactDescent::harden(Vec displacement) {
  objective_.positions().update(displacement);
  discrete::Contact& contact = tangent_.change_contact();
  contact.update_gaps();
  contact.set_multipliers(contact.pressures());
  contact.set_stiffness(stiffness_);
}

void ContactDescent::slacken(Vec displacement) {
  constexpr double slack = 0.01, roughly = 0.1;  // of the stiffness; mm
  tangent_.change_contact().set_multipliers({});
  tangent_.change_contact().set_stiffness(slack * stiffness_);
  minimizer_.presolve(displacement, roughly);
  tangent_.change_contact().set_stiffness(stiffness_);
}

ContactDescent::End ContactDescent::approach(Vec displacement, int64_t& iterations) {
  constexpr double roughly = 0.1, finely = 0.02;  // mm
  objective_.contact().round_edges(true);
  soften();
  const Outcome near = minimizer_.presolve(displacement, roughly);
  harden(displacement);
  iterations += near.iterations;
  const End end = near.stopped ? End::stopped : programs_.run(displacement, finely, iterations);
  tangent_.change_contact().round_edges(false);
  return end;
}

Outcome ContactDescent::finish(Vec displacement, double accuracy) {
  tangent_.forget_contact();
  const auto [length, left] = programs_.take_last_step();
  Outcome outcome = minimizer_.finish(displacement, (1 - missed) * accuracy, length);
  objective_.positions().update(displacement);
  outcome.displacement_error += contact_safety * std::max(left, objective_.contact().violation());
  const MPI_Comm comm = objective_.positions().comm();
  const mechanics::BodyContact& contact = objective_.contact().bodies();
  outcome.overlapped = base::sum_over_ranks(comm, contact.count_released());
  outcome.converged = outcome.converged && outcome.displacement_error <= accuracy &&
                      !base::on_any_rank(comm, contact.any_overlapped());
  return outcome;
}

Outcome ContactDescent::finish_reached(Vec displacement, double accuracy, int64_t& iterations) {
  constexpr int max_finer = 2;
  constexpr double finer = 0.25;
  Outcome outcome = finish(displacement, accuracy);
  double to = accuracy;
  for (int n = 0; n < max_finer && !outcome.converged && outcome.stable; ++n) {
    if (programs_.run(displacement, to *= finer, iterations) != End::reached) break;
    outcome = finish(displacement, accuracy);
  }
  return outcome;
}

/// Releases points between bodies that overlap from one of them. Returns true if there are any.
/// Collective.
bool ContactDescent::release_overlapped() {
  discrete::Positions& positions = objective_.positions();
  mechanics::BodyContact& contact = objective_.contact().bodies();
  contact.update_gaps(positions.local());
  const bool any = base::on_any_rank(positions.comm(), contact.release_overlapped());
  if (any) tangent_.forget_contact();
  return any;
}

/// Leads points between bodies that overlap out round an edge of one of them. Returns true if there
/// are any that have such a way. Collective.
bool ContactDescent::lead_out(Vec displacement) {
  discrete::Positions& positions = objective_.positions();
  programs_.evaluate(displacement);
  programs_.linearize(displacement);
  const auto ways = objective_.contact().bodies().ways_out(positions.local());
  if (!base::on_any_rank(positions.comm(), !ways.empty())) return false;
  const bool found = programs_.step_with(ways, displacement);
  tangent_.forget_contact();
  return found;
}

Outcome ContactDescent::stopped(Vec displacement, Outcome outcome) {
  outcome.converged = false;
  outcome.stopped = true;
  outcome.reason = stopped_reason;
  outcome.stable = !programs_.reduced();
  outcome.displacement_error = std::numeric_limits<double>::infinity();
  outcome.objective = programs_.evaluate(displacement);
  outcome.gradient_max = programs_.largest_force();
  return outcome;
}

Outcome continued(Outcome before, Outcome next) {
  next.iterations += before.iterations;
  next.other = std::move(before.other);
  return next;
}

Outcome ContactDescent::refine(Vec displacement, double accuracy, Outcome outcome) {
  if (outcome.converged && outcome.displacement_error > accuracy)
    outcome = continued(std::move(outcome), settle(displacement, accuracy, most_rounds, false));
  if (!outcome.converged && (outcome.stable || outcome.displacement_error > accuracy))
    outcome.reason = fmt::format("contact did not converge: {:.3g} mm of gaps remain",
                                 objective_.contact().violation());
  return outcome;
}

Outcome ContactDescent::settle(Vec displacement, double accuracy, int max_rounds,
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
    return left++ < max_left && programs_.leave_lower_saddle(displacement, saddle);
  };
  stiffen(times);
  for (int round = 0; round < max_rounds;) {
    if (needs_presolve) {
      soften();
      const Outcome near = minimizer_.presolve(displacement, accuracy);
      harden(displacement);
      iterations += near.iterations;
      if (near.stopped) return stopped(displacement, outcome);
    }
    const End end = programs_.run(displacement, accuracy, iterations);
    if (end == End::stopped) return stopped(displacement, outcome);
    if (end == End::failed && programs_.reduced() && leaves()) continue;
    outcome = end == End::reached ? finish_reached(displacement, accuracy, iterations)
                                  : finish(displacement, accuracy);
    if (outcome.converged) break;
    if (!outcome.stable && leaves()) continue;
    const double before = std::exchange(missing, objective_.contact().violation());
    if (missing > steady * before) {
      const bool leads = !std::exchange(led_out, true) && lead_out(displacement);
      if (leads || release_overlapped()) {
        missing = none;
        needs_presolve = !leads;
        continue;
      }
    }
    needs_presolve = end != End::reached;
    stiffen(times = std::min(2 * times, stiffest));
    ++round;
  }
  outcome.iterations += iterations;
  return outcome;
}

}  // namespace repose::solve
