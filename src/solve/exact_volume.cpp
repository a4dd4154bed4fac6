#include "exact_volume.h"

#include <algorithm>

#include "repose/mechanics/prism_volume.h"

namespace repose::solve {

using base::check;

ExactVolume::ExactVolume(discrete::Objective& objective, discrete::Tangent& tangent,
                         linear::TangentSolver& solver, Minimiser& minimiser)
    : objective_(objective),
      tangent_(tangent),
      solver_(solver),
      minimiser_(minimiser),
      first_weight_(objective.weights().volume_weight),
      start_weight_(first_weight_),
      start_target_(objective.prisms().target_volume),
      before_(objective.positions().make_vector()),
      gradient_(objective.positions().make_vector()),
      correction_(objective.positions().make_vector()) {
  solver.give_way();
}

std::vector<double> ExactVolume::multipliers() const {
  const mechanics::PrismLoop& prisms = objective_.prisms();
  const double weight = objective_.weights().volume_weight;
  std::vector<double> pressure;
  for (int64_t e = 0; e < prisms.size(); ++e)
    pressure.push_back(weight * (prisms.target_volume[e] / prisms.rest_volume[e] - 1));
  return pressure;
}

void ExactVolume::set_multipliers(const std::vector<double>& pressure, double weight) {
  mechanics::PrismLoop& prisms = objective_.prisms();
  for (int64_t e = 0; e < prisms.size(); ++e)
    prisms.target_volume[e] = prisms.rest_volume[e] * (1 + pressure[e] / weight);
  objective_.set_volume_weight(weight);
  tangent_.forget();
}

/// Newton's method at fixed multipliers, as far as it lessens the largest force.
void ExactVolume::balance(Vec displacement, Outcome& outcome) {
  constexpr int most = 5;
  constexpr double close = 1e-10;  // of the right-hand side, for the linear systems
  outcome.objective = objective_.evaluate(displacement, gradient_);
  outcome.gradient_max = discrete::largest_block(gradient_);
  for (int i = 0; i < most && outcome.gradient_max > 0; ++i) {
    check(VecCopy(displacement, before_));
    if (!solver_.solve(displacement, gradient_, correction_, close)) break;
    check(VecAXPY(displacement, -1, correction_));
    const double objective = objective_.evaluate(displacement, gradient_);
    const double largest = discrete::largest_block(gradient_);
    if (largest > 0.5 * outcome.gradient_max) {
      check(VecCopy(before_, displacement));
      objective_.positions().update(displacement);
      break;
    }
    ++outcome.iterations;
    outcome.objective = objective;
    outcome.gradient_max = largest;
  }
}

Outcome ExactVolume::search(Vec displacement, double accuracy, double allowed) {
  constexpr int most_rounds = 40;
  constexpr double slow = 0.2, growth = 10, stiffest = 1e6;  // of the error, of κ, of the first κ
  // mm, of each minimisation: a state out of balance makes multipliers that are no pressures.
  constexpr double coarsest = 1e-4, finest = 1e-9;
  double error = 0, before = std::numeric_limits<double>::infinity();
  Outcome outcome;
  int64_t iterations = 0;
  for (int round = 0; round < most_rounds; ++round) {
    check(VecCopy(displacement, before_));
    const double wanted = round == 0 ? coarsest : std::clamp(0.01 * error, finest, coarsest);
    outcome = minimiser_.run(displacement, std::min(accuracy, wanted));
    iterations += outcome.iterations;
    objective_.positions().update(displacement);
    error = objective_.totals().volume_error_max;
    check(VecAXPY(before_, -1, displacement));
    if (round > 0) outcome.displacement_error += discrete::largest_block(before_);
    if (outcome.stopped) outcome.converged = false;
    // Only the next round tells how far a state is from that with the volume kept.
    const bool at_rest = round > 0 && outcome.converged && outcome.displacement_error <= accuracy;
    if (!outcome.converged || (at_rest && error <= allowed)) break;
    double weight = objective_.weights().volume_weight;
    if (error > slow * before) weight *= growth;
    outcome.converged = false;
    outcome.reason = fmt::format(
        "the volume cannot be kept where the bones have moved: a prism's error stays at {:.3g}",
        error);
    if (weight > stiffest * first_weight_) break;
    set_multipliers(discrete::pressures(objective_), weight);
    before = error;
  }
  outcome.iterations = iterations;
  return outcome;
}

Outcome ExactVolume::run(Vec displacement, double accuracy) {
  constexpr double softened = 1e4;  // of the first κ
  start_target_ = objective_.prisms().target_volume;
  start_weight_ = objective_.weights().volume_weight;
  const double weight = std::min(start_weight_, softened * first_weight_);
  set_multipliers(multipliers(), weight);
  if (weight < start_weight_) solver_.renew(displacement);
  const double allowed = objective_.positions().load() < 1 ? on_the_way : tolerance;
  Outcome outcome = search(displacement, accuracy, allowed);
  if (!outcome.converged) return outcome;
  balance(displacement, outcome);
  return outcome;
}

void ExactVolume::go_back(Vec displacement) {
  objective_.prisms().target_volume = start_target_;
  objective_.set_volume_weight(start_weight_);
  tangent_.forget();
  solver_.renew(displacement);  // that of another κ is of no use to the next prediction
}

}  // namespace repose::solve
