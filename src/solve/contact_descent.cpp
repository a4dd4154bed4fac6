#include "contact_descent.h"

#include <algorithm>

namespace repose::solve {

namespace {

constexpr double missed = 0.25;       // of the accuracy, by contact
constexpr double contact_safety = 2;  // the estimate is so many times what is left

}  // namespace

ContactDescent::ContactDescent(discrete::Objective& objective, discrete::Tangent& tangent,
                               Minimizer& minimizer, ContactPenalty& penalty,
                               ContactPrograms& programs)
    : objective_(objective),
      tangent_(tangent),
      minimizer_(minimizer),
      penalty_(penalty),
      programs_(programs),
      stiffness_(objective_.positions().part().model.contact.stiffness) {}

void ContactDescent::stiffen(int times) {
  times_ = times;
  stiffness_ = times * objective_.positions().part().model.contact.stiffness;
  programs_.set_stiffness(stiffness_);
  penalty_.set_stiffness(stiffness_);
}

/// Softens the penalty, which lets points change sides a few at a time.
void ContactDescent::soften() {
  constexpr double softened = 0.25;
  penalty_.set_stiffness(softened * stiffness_);
}

/// Takes the pressures of a soft search that ended at `displacement` as multipliers, at the full
/// stiffness again. Returns by how much they change, mm of gaps.
double ContactDescent::harden(Vec displacement) {
  objective_.positions().update(displacement);
  const double left = penalty_.violation();
  penalty_.move_multipliers();
  penalty_.set_stiffness(stiffness_);
  return left;
}

Outcome ContactDescent::presolve(Vec displacement, double accuracy) {
  constexpr int maximum = 5;
  constexpr double small = 0.05;  // mm of gaps
  Outcome outcome;
  int64_t iterations = 0;
  for (int n = 0; n < maximum; ++n) {
    soften();
    outcome = minimizer_.presolve(displacement, accuracy, true);
    iterations += outcome.iterations;
    if (harden(displacement) <= std::max(small, accuracy) || outcome.stopped) break;
  }
  outcome.iterations = iterations;
  return outcome;
}

void ContactDescent::slacken(Vec displacement) {
  constexpr double slack = 0.01, roughly = 0.1;  // of the stiffness; mm
  penalty_.set_multipliers({});
  penalty_.set_stiffness(slack * stiffness_);
  minimizer_.presolve(displacement, roughly, false);
  penalty_.set_stiffness(stiffness_);
}

ContactDescent::End ContactDescent::approach(Vec displacement, double accuracy,
                                             int64_t& iterations) {
  constexpr double roughly = 0.1, finely = 0.004;  // mm
  objective_.contact().round_bodies(true);
  soften();
  const Outcome near = minimizer_.presolve(displacement, std::max(roughly, accuracy), false);
  harden(displacement);
  iterations += near.iterations;
  const End end = near.stopped ? End::stopped : programs_.run(displacement, finely, iterations);
  objective_.contact().round_bodies(false);
  tangent_.forget_contact();
  return end;
}

Outcome ContactDescent::finish(Vec displacement, double accuracy) {
  tangent_.forget_contact();
  Outcome outcome =
      minimizer_.finish(displacement, (1 - missed) * accuracy, programs_.take_last_step());
  objective_.positions().update(displacement);
  outcome.displacement_error += contact_safety * penalty_.violation();
  outcome.converged = outcome.converged && outcome.displacement_error <= accuracy;
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

}  // namespace repose::solve
