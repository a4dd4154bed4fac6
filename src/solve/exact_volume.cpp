#include "repose/solve/exact_volume.h"

#include <algorithm>

#include "repose/mechanics/prism_volume.h"

namespace repose::solve {

using base::check;

std::vector<double> pressures(Objective& objective) {
  const mechanics::PrismLoop& prisms = objective.prisms();
  const auto position = objective.positions().local();
  std::vector<double> pressure;
  for (int64_t e = 0; e < prisms.size(); ++e) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = position[prisms.points[e][c]];
    const double change = prisms.target_volume[e] - mechanics::prism_volume(corners.data());
    pressure.push_back(objective.weights().volume_weight * change / prisms.rest_volume[e]);
  }
  return pressure;
}

ExactVolume::ExactVolume(Objective& objective, Tangent& tangent, Minimiser& minimiser)
    : objective_(objective),
      tangent_(tangent),
      minimiser_(minimiser),
      first_weight_(objective.weights().volume_weight),
      before_(objective.positions().make_vector()) {}

void ExactVolume::update_multipliers(double weight) {
  const std::vector<double> pressure = pressures(objective_);
  mechanics::PrismLoop& prisms = objective_.prisms();
  for (int64_t e = 0; e < prisms.size(); ++e)
    prisms.target_volume[e] = prisms.rest_volume[e] * (1 + pressure[e] / weight);
  objective_.set_volume_weight(weight);
  tangent_.forget();
}

Outcome ExactVolume::run(Vec displacement, double accuracy) {
  constexpr int most_rounds = 40;
  constexpr double slow = 0.2, growth = 10, stiffest = 1e6;  // of the error, of κ, of the first κ
  constexpr double finest = 1e-9;                            // mm
  const double allowed = objective_.positions().load() < 1 ? on_the_way : tolerance;
  double error = 0, before = std::numeric_limits<double>::infinity();
  Outcome outcome;
  int64_t iterations = 0;
  for (int round = 0; round < most_rounds; ++round) {
    check(VecCopy(displacement, before_));
    const double wanted = round == 0 ? accuracy : std::max(finest, 0.01 * std::min(error, 1.0));
    outcome = minimiser_.run(displacement, std::min(accuracy, wanted));
    iterations += outcome.iterations;
    objective_.positions().update(displacement);
    error = objective_.totals().volume_error_max;
    check(VecAXPY(before_, -1, displacement));
    if (round > 0) outcome.displacement_error += largest_block(before_);
    const bool at_rest = outcome.converged && outcome.displacement_error <= accuracy;
    if (!outcome.converged || (at_rest && error <= allowed)) break;
    double weight = objective_.weights().volume_weight;
    if (error > slow * before) weight *= growth;
    outcome.converged = false;
    outcome.reason = fmt::format(
        "the volume cannot be kept where the bones have moved: a prism's error stays at {:.3g}",
        error);
    if (weight > stiffest * first_weight_) break;
    update_multipliers(weight);
    before = error;
  }
  outcome.iterations = iterations;
  return outcome;
}

}  // namespace repose::solve
