#include "contact_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// mm, by which pressures differ from multipliers, over the penalty's stiffness: the gap where a
/// point presses or slides, what a multiplier still pretends where it does not.
double ContactSearch::violation() {
  mechanics::TouchLoop& touches = objective_.touches();
  touches.look(objective_.positions().local());
  double most = 0;
  for (size_t c = 0; c < touches.multipliers().size(); ++c)
    most = std::max(most, std::abs(touches.pressure(c) - touches.multipliers()[c]));
  mechanics::WallLoop& walls = objective_.walls();
  walls.look(objective_.positions().local());
  for (size_t w = 0; w < walls.size(); ++w)
    most = std::max(most, std::abs(walls.pressure(w) - walls.multipliers()[w]));
  return largest(objective_.positions().comm(), most / objective_.touches().stiffness());
}

void ContactSearch::move_multipliers() {
  mechanics::TouchLoop& touches = objective_.touches();
  std::vector<double> pressure(touches.multipliers().size());
  for (size_t c = 0; c < pressure.size(); ++c) pressure[c] = touches.pressure(c);
  touches.set_multipliers(pressure);
  mechanics::WallLoop& walls = objective_.walls();
  pressure.resize(walls.size());
  for (size_t w = 0; w < pressure.size(); ++w) pressure[w] = walls.pressure(w);
  walls.set_multipliers(pressure);
}

Outcome ContactSearch::run(Vec displacement, double accuracy) {
  constexpr int most_rounds = 30, rough_rounds = 2;
  constexpr double softened = 0.25;  // of the penalty's stiffness, in rough rounds
  constexpr double rough = 0.25;     // mm
  constexpr double missed = 0.25;    // of the accuracy, by contact
  // Multipliers that go from one state to another and back do so no more under a stiffer penalty.
  constexpr double slow = 0.9, stiffer = 2, stiffest = 16;
  constexpr double safety = 2;  // the estimate is so many times what is left
  const auto p = objective_.touches().multipliers(), q = objective_.walls().multipliers();
  before_.assign(p.begin(), p.end());
  walls_before_.assign(q.begin(), q.end());
  Outcome outcome;
  int64_t iterations = 0;
  for (int round = 0; round < rough_rounds; ++round) {
    set_stiffness(softened * stiffness_);
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
  double stiffness = stiffness_, least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < most_rounds && !outcome.stopped; ++round) {
    outcome = minimiser_.run(displacement, (1 - missed) * accuracy);
    iterations += outcome.iterations;
    objective_.positions().update(displacement);
    const double left = violation();
    outcome.displacement_error += safety * left;
    const bool over = outcome.converged && outcome.displacement_error <= accuracy;
    if (!outcome.converged || over) break;
    move_multipliers();
    if (left > slow * least && stiffness < stiffest * stiffness_) stiffness *= stiffer;
    set_stiffness(stiffness);
    least = std::min(least, left);
    outcome.converged = false;
    outcome.reason = fmt::format("contact comes to no end: {:.3g} mm of gaps remain", left);
  }
  outcome.iterations = iterations;
  return outcome;
}

void ContactSearch::go_back(Vec) {
  objective_.touches().set_multipliers(before_);
  objective_.walls().set_multipliers(walls_before_);
  tangent_.forget();
}

double penetration(discrete::Objective& objective) {
  mechanics::TouchLoop& touches = objective.touches();
  const auto position = objective.positions().local();
  touches.look_at_all(position);
  double deepest = 0;
  for (const double gap : touches.gaps()) deepest = std::max(deepest, -gap);
  mechanics::WallLoop& walls = objective.walls();
  walls.look(position);
  for (size_t w = 0; w < walls.size(); ++w) deepest = std::max(deepest, -walls.gap(w));
  return largest(objective.positions().comm(), deepest);
}

}  // namespace repose::solve
