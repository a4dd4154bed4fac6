#include "contact_programs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "leave_saddle.h"

namespace repose::solve {

using base::check;

namespace {

constexpr double predicted_to = 0.1;  // mm

}  // namespace

ContactPrograms::ContactPrograms(discrete::Objective& objective, discrete::Tangent& tangent,
                                 linear::TangentSolver& solver, Minimizer::Watch watch)
    : objective_(objective),
      tangent_(tangent),
      solver_(solver),
      qp_(objective, tangent, solver),
      watch_(std::move(watch)),
      gradient_(objective.positions().make_vector()),
      slope_(objective.positions().make_vector()),
      step_(objective.positions().make_vector()),
      trial_(objective.positions().make_vector()) {}

bool ContactPrograms::predict(Vec displacement, double load, Vec increment) {
  discrete::Positions& positions = objective_.positions();
  positions.update(displacement);
  objective_.contact().place_bodies();
  const std::vector<Vec3> travel = positions.travel_to(load);
  objective_.contact().round_edges(true);
  check(VecSet(gradient_, 0));  // it is at rest
  subtract_contact();
  qp_.gaps().linearize(displacement, load, travel);
  objective_.hessian_action(travel, trial_, false);
  objective_.add_carried(load, trial_);
  check(VecAXPY(slope_, 1.0, trial_));
  return qp_.solve(displacement, slope_, predicted_to, increment);
}

/// slope_ = gradient_ without its part of contact, at the objective's last update.
void ContactPrograms::subtract_contact() {
  const discrete::Part& part = objective_.positions().part();
  std::vector<Vec3> force = objective_.contact_force();
  for (Vec3& f : force) f *= objective_.weights().elastic;
  force.resize(part.point_row.size(), Vec3::Zero());
  objective_.positions().restrict_to_owned(force, slope_);
  check(VecAXPY(slope_, 1.0, gradient_));
}

double ContactPrograms::without_contact(double value) {
  return value - objective_.weights().elastic * objective_.contact_value();
}

/// Takes step_, whose largest block is `length` mm, or less of it, where that lowers the augmented
/// Lagrangian of the new multipliers from `tissue`, the value without contact. Its full length is
/// tried first, or as much as the gaps, taken to first order, may hold for.
double ContactPrograms::take_step(Vec displacement, double length, double tissue) {
  constexpr int max_halved = 6;
  constexpr double rounding = 1e-12;
  constexpr double longest = 2;  // mm
  const auto try_step = [&](double share) {
    check(VecCopy(displacement, trial_));
    check(VecAXPY(trial_, share, step_));
    return evaluate(trial_);
  };
  const double merit = tissue + objective_.weights().elastic * objective_.contact_value();
  const double largest = merit + rounding * std::abs(merit);
  double share = std::min(1.0, longest / length);
  try_step(share);
  for (int k = 0; k < max_halved && value_ > largest; ++k) try_step(share /= 2);
  if (value_ > largest) {
    evaluate(displacement);
    return 0;
  }
  check(VecCopy(trial_, displacement));
  return share;
}

ContactPrograms::End ContactPrograms::run(Vec displacement, double accuracy, int64_t& iterations) {
  evaluate(displacement);
  reach_ = ContactGaps::farthest;
  return go_on(displacement, accuracy, iterations);
}

/// Returns a full step of `length` mm after one of `before`, or 0. Steps that fall on by the same
/// ratio θ lead θ / (1 − θ) times as far; ½ is taken where θ is not known.
ContactPrograms::Step ContactPrograms::after(double before, double length) {
  constexpr double most = 0.99;
  const double ratio = before > 0 ? std::min(length / before, most) : 0.5;
  return {length, length * ratio / (1 - ratio)};
}

ContactPrograms::End ContactPrograms::go_on(Vec displacement, double accuracy, int64_t& iterations,
                                            int max_steps) {
  constexpr double near = 0.25, finer = 0.1;  // of the accuracy: a distance that ends; a program's
  constexpr double at_saddle = 0.05;          // mm: such steps do not leave a saddle
  qp_.gaps().relax();
  last_ = {};
  for (int n = 0; n < max_steps; ++n) {
    const double tissue = without_contact(value_);
    linearize(displacement, reach_);
    if (!solve(displacement, finer * accuracy)) return End::failed;
    const double length = discrete::largest_block(step_);
    const double share = take_step(displacement, length, tissue);
    if (share == 0) return End::failed;
    last_ = share == 1 ? after(last_.length, length) : Step{0, length};
    ++iterations;
    if (qp_.reduced() && length <= at_saddle) return End::failed;
    if (!qp_.reduced() && last_.left <= near * accuracy) return End::reached;
    if (watch_ && !watch_({iterations, objective_.positions().load(), value_,
                           discrete::largest_block(gradient_), length, objective_.evaluations(),
                           displacement}))
      return End::stopped;
  }
  return End::failed;
}

/// Solves a program for step_, whose length tells how far the next takes gaps. Returns whether it
/// has a minimum.
bool ContactPrograms::solve(Vec displacement, double tolerance) {
  constexpr double nearest = 1;  // mm
  const bool found = qp_.solve(displacement, slope_, tolerance, step_);
  reach_ = std::clamp(2 * discrete::largest_block(step_), nearest, ContactGaps::farthest);
  return found;
}

bool ContactPrograms::leave_lower_saddle(Vec displacement, double& latest) {
  constexpr double lower = 1e-6;  // of the value
  tangent_.forget_contact();
  const double value = evaluate(displacement);
  if (!(value < latest - lower * std::abs(value))) return false;
  latest = value;
  return leave_saddle(objective_, solver_, displacement);
}

void ContactPrograms::linearize(Vec displacement, double reach) {
  subtract_contact();
  qp_.gaps().linearize(displacement, reach);
}

ContactPrograms::Kept ContactPrograms::keep() {
  Kept kept{qp_.gaps().keep(), objective_.positions().make_vector()};
  check(VecCopy(slope_, kept.slope));
  return kept;
}

void ContactPrograms::restore(const Kept& kept) {
  qp_.gaps().restore(kept.gaps);
  check(VecCopy(kept.slope, slope_));
}

bool ContactPrograms::step_with(std::span<const mechanics::LinearGap> gaps, Vec displacement) {
  qp_.gaps().relax();
  for (const mechanics::LinearGap& gap : gaps) qp_.gaps().replace(gap);
  constexpr double tried_to = 0.02;  // mm: coarser steps end elsewhere on other ranks
  if (!solve(displacement, tried_to)) return false;
  check(VecAXPY(displacement, 1.0, step_));
  return true;
}

}  // namespace repose::solve
