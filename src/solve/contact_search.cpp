#include "contact_search.h"

#include <algorithm>
#include <cmath>

namespace repose::solve {

namespace {

double largest(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, comm);
  return value;
}

}  // namespace

ContactSearch::ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                             Minimiser& minimiser)
    : objective_(objective),
      tangent_(tangent),
      minimiser_(minimiser),
      stiffness_(objective.positions().part().model.contact.stiffness) {}

void ContactSearch::set_stiffness(double stiffness) {
  objective_.touches().set_stiffness(stiffness);
  objective_.walls().set_stiffness(stiffness);
  tangent_.forget();
}

void ContactSearch::pair(Vec displacement, double anew) {
  int any = objective_.walls().empty() ? 0 : 1;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, objective_.positions().comm());
  tangent_.forget();
  if (!any) return;
  objective_.positions().update(displacement);
  objective_.walls().pair(objective_.positions().local(), anew);
  tangent_.change_pattern();
}

/// mm, by which pressures differ from multipliers, over the penalty's stiffness: the gap where a
/// point presses or slides, what a multiplier still pretends where it does not.
double ContactSearch::violation() {
  mechanics::TouchLoop& touches = objective_.touches();
  touches.look(objective_.positions().local());
  double most = 0;
  for (size_t c = 0; c < touches.multipliers().size(); ++c)
    most = std::max(most, std::abs(touches.pressure(c) - touches.multipliers()[c]));
  const mechanics::WallLoop& walls = objective_.walls();
  for (const mechanics::WallPair& pair : walls.pairs()) {
    if (pair.area == 0) continue;
    const double gap = pair.gap(objective_.positions().local());
    const double pressure =
        mechanics::press(gap, pair.multiplier, walls.stiffness(), false).pressure;
    most = std::max(most, std::abs(pressure - pair.multiplier));
  }
  return largest(objective_.positions().comm(), most / objective_.touches().stiffness());
}

void ContactSearch::move_multipliers() {
  mechanics::TouchLoop& touches = objective_.touches();
  std::vector<double> pressure(touches.multipliers().size());
  for (size_t c = 0; c < pressure.size(); ++c) pressure[c] = touches.pressure(c);
  touches.set_multipliers(pressure);
  mechanics::WallLoop& walls = objective_.walls();
  const auto position = objective_.positions().local();
  for (mechanics::WallPair& pair : walls.pairs())
    if (pair.area > 0)
      pair.multiplier =
          mechanics::press(pair.gap(position), pair.multiplier, walls.stiffness(), false).pressure;
}

Outcome ContactSearch::run(Vec displacement, double accuracy) {
  constexpr int most_rounds = 30, rough_rounds = 2;
  // Pairs of points that slide past each other come and go for ever if found anew in every round.
  constexpr int paired_anew = 2;
  constexpr double damped = 0.5;
  constexpr double softened = 0.25;  // of the penalty's stiffness, in rough rounds
  constexpr double rough = 0.25;     // mm
  constexpr double missed = 0.25;    // of the accuracy, by contact
  constexpr double safety = 2;       // the estimate is so many times what is left
  const auto p = objective_.touches().multipliers();
  before_.assign(p.begin(), p.end());
  walls_before_.clear();
  for (const auto& pair : objective_.walls().pairs()) walls_before_.push_back(pair.multiplier);
  Outcome outcome;
  int64_t iterations = 0;
  for (int round = 0; round < rough_rounds; ++round) {
    set_stiffness(softened * stiffness_);
    pair(displacement, round == 0 ? 1 : damped);
    outcome = minimiser_.approach(displacement, std::max(rough, accuracy));
    iterations += outcome.iterations;
    if (outcome.stopped) break;
    objective_.positions().update(displacement);
    move_multipliers();
  }
  set_stiffness(stiffness_);
  if (outcome.stopped) {
    const base::VecHandle gradient = objective_.positions().make_vector();
    outcome.objective = objective_.evaluate(displacement, gradient);
    outcome.gradient_max = discrete::largest_block(gradient);
  }
  for (int round = 0; round < most_rounds && !outcome.stopped; ++round) {
    if (round < paired_anew) pair(displacement, damped);
    outcome = minimiser_.run(displacement, (1 - missed) * accuracy);
    iterations += outcome.iterations;
    objective_.positions().update(displacement);
    const double left = violation();
    outcome.displacement_error += safety * left;
    const bool over = outcome.converged && outcome.displacement_error <= accuracy;
    if (!outcome.converged || over) break;
    move_multipliers();
    tangent_.forget();
    outcome.converged = false;
    outcome.reason = fmt::format("contact comes to no end: {:.3g} mm of gaps remain", left);
  }
  outcome.iterations = iterations;
  return outcome;
}

void ContactSearch::go_back(Vec displacement) {
  objective_.touches().set_multipliers(before_);
  for (size_t w = 0; w < walls_before_.size(); ++w)
    objective_.walls().pairs()[w].multiplier = walls_before_[w];
  pair(displacement, 1);
}

double penetration(discrete::Objective& objective) {
  mechanics::TouchLoop& touches = objective.touches();
  const auto position = objective.positions().local();
  touches.look_at_all(position);
  double deepest = 0;
  for (const double gap : touches.gaps()) deepest = std::max(deepest, -gap);
  mechanics::WallLoop now = objective.walls();
  if (!now.empty()) now.pair(position);
  for (const mechanics::WallPair& pair : now.pairs())
    if (pair.area > 0) deepest = std::max(deepest, -pair.gap(position));
  return largest(objective.positions().comm(), deepest);
}

}  // namespace repose::solve
