#include "repose/solve/stiffening.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace repose::solve {

namespace {

constexpr double soft = 10;       // κ of the tissue's effective modulus
constexpr double stiff = 2;       // of the soft κ; below, the load path alone is cheaper
constexpr double stiffest = 150;  // of the soft κ; above, the way along κ may jump to another rest
constexpr double growth = 10;     // of κ at once, at most
constexpr double loosest = 0.1;   // mm, accuracy of what only leads on

/// How many times stiffer than soft the volume term is, 0 where there is none.
double stiffness(const discrete::Objective& objective) {
  const mechanics::Weights& weights = objective.weights();
  if (weights.volume == mechanics::VolumeTerm::none || weights.elastic == 0) return 0;
  std::array<double, 3> sums{};  // Σ k0 r_0², Σ v_0, prisms
  for (const mechanics::SpringLoop& loop : objective.loops().springs)
    for (int64_t e = 0; e < loop.counted; ++e)
      sums[0] += loop.stiffness[e] * loop.rest_length[e] * loop.rest_length[e];
  const mechanics::PrismLoop& prisms = objective.loops().prisms;
  for (int64_t e = 0; e < prisms.counted; ++e) sums[1] += prisms.rest_volume[e];
  sums[2] = static_cast<double>(prisms.counted);
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 3, MPI_DOUBLE, MPI_SUM, objective.positions().comm());
  if (!(sums[0] > 0 && sums[1] > 0)) return 0;
  const double modulus = weights.elastic * sums[0] / sums[1];
  const bool paper = weights.volume == mechanics::VolumeTerm::paper;  // ½ κ / v_0 is its weight
  const double bulk = paper ? 2 * weights.volume_weight * sums[1] / sums[2] : weights.volume_weight;
  return bulk / (soft * modulus);
}

}  // namespace

Stiffening::Stiffening(Problem& problem, Predictor& predictor, RestSearch& search)
    : objective_(problem.objective()),
      tangent_(problem.tangent()),
      predictor_(predictor),
      search_(search) {
  const double times = stiffness(objective_), weight = objective_.weights().volume_weight;
  if (!(times > stiff && times <= stiffest)) return;
  const double stages = std::ceil(std::log(times) / std::log(growth));
  for (double k = 0; k < stages; ++k) weight_.push_back(weight * std::pow(times, k / stages - 1));
  weight_.push_back(weight);
}

void Stiffening::set_weight(double weight) {
  objective_.set_volume_weight(weight);
  tangent_.forget();
}

bool Stiffening::stiffen(Vec displacement, double accuracy) {
  for (size_t k = 1; k + 1 < weight_.size(); ++k) {
    set_weight(weight_[k]);
    const Outcome outcome = search_.run(displacement, accuracy);
    if (outcome.stopped) return true;
    if (!outcome.converged) return false;
  }
  return true;
}

bool Stiffening::run(Vec displacement, PathSettings settings) {
  settings.accuracy = std::max(settings.accuracy, loosest);
  set_weight(weight_.front());
  LoadPath path(objective_, predictor_, search_, settings);
  const PathOutcome outcome =
      path.run(displacement, nullptr, [](const Outcome&, double, double) {});
  const bool led = outcome.complete() && stiffen(displacement, settings.accuracy);
  set_weight(weight_.back());
  objective_.positions().set_load(0);
  return led;
}

PathOutcome follow_bones(Problem& problem, RestSearch& search, bool exact_volume,
                         PathSettings settings, Vec displacement, Vec guess,
                         const LoadPath::OnStep& on_step) {
  discrete::Objective& objective = problem.objective();
  const discrete::Positions& positions = objective.positions();
  Predictor predictor(objective, problem.elastic_solver());
  const bool plain = !problem.force() && !exact_volume;
  const bool automatic = settings.load_steps == 0 && settings.start_load == 0;
  const double begin = MPI_Wtime();
  const int64_t evaluations = problem.function().evaluations();
  base::VecHandle led;
  if (plain && automatic && !guess && positions.largest_travel() > 0) {
    Stiffening stiffening(problem, predictor, search);
    if (stiffening.pays()) {
      led = positions.make_vector();
      base::check(VecCopy(displacement, led));
      if (!stiffening.run(led, settings)) led = {};
    }
  }
  const int64_t softer = problem.function().evaluations() - evaluations;
  double seconds_before = MPI_Wtime() - begin;
  // Far from rest, forces and the multipliers of exact volume cost more than the steps that a long
  // one saves, and with the paper's volume term, hardly convex, a search wanders.
  if (!plain || objective.weights().volume == mechanics::VolumeTerm::paper)
    settings.longest_stride = LoadPath::short_stride;
  LoadPath path(objective, predictor, search, settings);
  PathOutcome outcome = path.run(displacement, led ? static_cast<Vec>(led) : guess,
                                 [&](const Outcome& last, double load, double seconds) {
                                   on_step(last, load, seconds + std::exchange(seconds_before, 0));
                                 });
  outcome.softer = softer;
  return outcome;
}

}  // namespace repose::solve
