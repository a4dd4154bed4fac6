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

namespace {

constexpr double missed = 0.25;       // of the accuracy, by contact
constexpr double contact_safety = 2;  // the estimate is so many times what is left
constexpr double predicted_to = 0.1;  // mm

}  // namespace

ContactSearch::ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                             linear::TangentSolver& solver, Minimizer& minimizer,
                             Minimizer::Watch watch)
    : objective_(objective),
      tangent_(tangent),
      solver_(solver),
      minimizer_(minimizer),
      watch_(std::move(watch)),
      qp_(objective, tangent, solver),
      stiffness_(objective_.positions().part().model.contact.stiffness),
      gradient_(objective.positions().make_vector()),
      slope_(objective.positions().make_vector()),
      step_(objective.positions().make_vector()),
      trial_(objective.positions().make_vector()),
      start_(objective.positions().make_vector()) {}

ContactPressures ContactSearch::pressures() const {
  const auto p = objective_.body_contact().multipliers(),
             q = objective_.cut_face_contact().multipliers();
  return {{p.begin(), p.end()}, {q.begin(), q.end()}};
}

void ContactSearch::set_pressures(const ContactPressures& to) {
  const auto resized = [](std::vector<double> pressures, size_t size) {
    pressures.resize(size, 0.0);
    return pressures;
  };
  objective_.body_contact().set_multipliers(
      resized(to.bodies, objective_.body_contact().multipliers().size()));
  objective_.cut_face_contact().set_multipliers(
      resized(to.cut_faces, objective_.cut_face_contact().size()));
  tangent_.forget_contact();
}

/// Takes so many times the model's stiffness from now on.
void ContactSearch::stiffen(int times) {
  times_ = times;
  stiffness_ = times * objective_.positions().part().model.contact.stiffness;
  qp_.set_stiffness(stiffness_);
  set_stiffness(stiffness_);
}

void ContactSearch::set_stiffness(double stiffness) {
  objective_.body_contact().set_stiffness(stiffness);
  objective_.cut_face_contact().set_stiffness(stiffness);
  tangent_.forget_contact();
}

/// mm, by which pressures differ from multipliers, over the penalty's stiffness: the gap where a
/// point presses or slides, what a multiplier still pretends where it does not.
double ContactSearch::violation() {
  mechanics::BodyContact& body_contact = objective_.body_contact();
  body_contact.update_gaps(objective_.positions().local());
  double maximum = 0;
  for (size_t c = 0; c < body_contact.multipliers().size(); ++c)
    maximum = std::max(maximum, std::abs(body_contact.pressure(c) - body_contact.multipliers()[c]));
  mechanics::CutFaceContact& cut_faces = objective_.cut_face_contact();
  cut_faces.update_gaps(objective_.positions().local());
  for (size_t w = 0; w < cut_faces.size(); ++w)
    maximum = std::max(maximum, std::abs(cut_faces.pressure(w) - cut_faces.multipliers()[w]));
  return base::max_over_ranks(objective_.positions().comm(),
                              maximum / objective_.body_contact().stiffness());
}

void ContactSearch::move_multipliers() {
  mechanics::BodyContact& body_contact = objective_.body_contact();
  std::vector<double> pressure(body_contact.multipliers().size());
  for (size_t c = 0; c < pressure.size(); ++c) pressure[c] = body_contact.pressure(c);
  body_contact.set_multipliers(pressure);
  mechanics::CutFaceContact& cut_faces = objective_.cut_face_contact();
  pressure.resize(cut_faces.size());
  for (size_t w = 0; w < pressure.size(); ++w) pressure[w] = cut_faces.pressure(w);
  cut_faces.set_multipliers(pressure);
}

std::optional<bool> ContactSearch::predict(Vec displacement, double load, Vec increment) {
  objective_.body_contact().restore_released();
  const ContactPressures before = pressures();
  predicted_ = true;
  discrete::Positions& positions = objective_.positions();
  positions.update(displacement);
  objective_.place_bodies();
  const discrete::Part& part = positions.part();
  std::vector<Vec3> travel(positions.local().size(), Vec3::Zero());
  for (size_t i = 0; i < travel.size(); ++i)
    if (part.unknown[i] < 0)
      travel[i] = positions.prescribed(static_cast<int64_t>(i), load) - positions.local()[i];
  objective_.round_bodies(true);
  stiffen(1);
  check(VecSet(gradient_, 0));  // it is at rest
  subtract_contact();
  qp_.linearize(displacement, load, travel);
  objective_.hessian_action(travel, trial_, false);
  check(VecAXPY(slope_, 1.0, trial_));
  const bool found = qp_.solve(displacement, slope_, predicted_to, increment);
  tangent_.forget_contact();
  if (!found) {
    objective_.round_bodies(false);
    set_pressures(before);
  }
  return found;
}

/// slope_ = gradient_ without its part of contact, at the objective's last update.
void ContactSearch::subtract_contact() {
  const discrete::Part& part = objective_.positions().part();
  std::vector<Vec3> force = objective_.contact_force();
  for (Vec3& f : force) f *= objective_.weights().elastic;
  force.resize(part.point_row.size(), Vec3::Zero());
  objective_.positions().restrict_to_owned(force, slope_);
  check(VecAXPY(slope_, 1.0, gradient_));
}

/// Searches on the augmented Lagrangian to `to` mm, then moves the multipliers by no more than
/// `left` mm of gaps. A soft penalty lets points change sides a few at a time. Collective.
Outcome ContactSearch::search_softly(Vec displacement, double to, bool near, double& left) {
  constexpr double softened = 0.25;  // of the penalty's stiffness
  set_stiffness(softened * stiffness_);
  const Outcome outcome = minimizer_.presolve(displacement, to, near);
  if (!outcome.stopped) {
    objective_.positions().update(displacement);
    left = violation();
    move_multipliers();
  }
  set_stiffness(stiffness_);
  return outcome;
}

/// Repeats the soft search until the multipliers hardly move.
Outcome ContactSearch::presolve(Vec displacement, double accuracy) {
  constexpr int maximum = 5;
  constexpr double small = 0.05;  // mm of gaps
  Outcome outcome;
  int64_t iterations = 0;
  double left = 0;
  for (int n = 0; n < maximum; ++n) {
    outcome = search_softly(displacement, accuracy, true, left);
    iterations += outcome.iterations;
    if (outcome.stopped || left <= std::max(small, accuracy)) break;
  }
  outcome.iterations = iterations;
  return outcome;
}

/// Finds the rest position among bodies with rounded edges, which catch fewer points on either
/// side. It is found so finely that the sides do not depend on the way to it.
ContactSearch::End ContactSearch::approach(Vec displacement, double accuracy, int64_t& iterations) {
  constexpr double roughly = 0.1, finely = 0.004;  // mm
  double left = 0;
  objective_.round_bodies(true);
  const Outcome near = search_softly(displacement, std::max(roughly, accuracy), false, left);
  iterations += near.iterations;
  const End end = near.stopped ? End::stopped : newton(displacement, finely, iterations);
  objective_.round_bodies(false);
  tangent_.forget_contact();
  return end;
}

/// Takes step_, whose largest block is `length` mm, or less of it, where that lowers the augmented
/// Lagrangian of the new multipliers from `tissue`, the value without contact. Its full length is
/// tried first, or as much as the gaps, taken to first order, may hold for.
double ContactSearch::take_step(Vec displacement, double length, double tissue, double& value) {
  constexpr int max_halved = 6;
  constexpr double rounding = 1e-12;
  constexpr double longest = 2;  // mm
  const auto try_step = [&](double share) {
    check(VecCopy(displacement, trial_));
    check(VecAXPY(trial_, share, step_));
    return objective_.evaluate(trial_, gradient_);
  };
  const double merit = tissue + objective_.weights().elastic * objective_.contact_value();
  const double largest = merit + rounding * std::abs(merit);
  double share = std::min(1.0, longest / length);
  value = try_step(share);
  for (int k = 0; k < max_halved && value > largest; ++k) value = try_step(share /= 2);
  if (value > largest) return 0;
  check(VecCopy(trial_, displacement));
  return share;
}

/// Steps of quadratic programs until one is shorter than half of `accuracy`, or the next would be:
/// full steps fall by at least the ratio of the latest two.
ContactSearch::End ContactSearch::newton(Vec displacement, double accuracy, int64_t& iterations,
                                         int max_steps) {
  constexpr double near = 0.5, finer = 0.1;  // of the accuracy: a step that ends; a program's
  constexpr double at_saddle = 0.05;         // mm: such steps do not leave a saddle
  constexpr double fast = 0.2;               // ratio of full steps that is trusted
  double value = objective_.evaluate(displacement, gradient_);
  taken_ = 0;
  for (int n = 0; n < max_steps; ++n) {
    subtract_contact();
    const double tissue = without_contact(value);
    qp_.linearize(displacement);
    if (!qp_.solve(displacement, slope_, finer * accuracy, step_)) return End::failed;
    const double length = discrete::largest_block(step_);
    const double share = take_step(displacement, length, tissue, value);
    if (share == 0) return End::failed;
    const double before = std::exchange(taken_, share == 1 ? length : 0);
    ++iterations;
    if (qp_.reduced() && length <= at_saddle) return End::failed;
    const bool falls = taken_ > 0 && taken_ <= fast * before;
    const double next = falls ? length * length / before : length;
    if (!qp_.reduced() && next <= near * accuracy) return End::reached;
    if (watch_ && !watch_({iterations, objective_.positions().load(), value,
                           discrete::largest_block(gradient_), length, objective_.evaluations(),
                           displacement}))
      return End::stopped;
  }
  return End::failed;
}

/// Ends the search where a strict estimate says that it is over.
Outcome ContactSearch::finish(Vec displacement, double accuracy) {
  tangent_.forget_contact();
  Outcome outcome =
      minimizer_.finish(displacement, (1 - missed) * accuracy, std::exchange(taken_, 0.0));
  objective_.positions().update(displacement);
  outcome.displacement_error += contact_safety * violation();
  outcome.converged = outcome.converged && outcome.displacement_error <= accuracy;
  return outcome;
}

/// finish() at a position that programs have reached. They go on where it misses the accuracy: an
/// end before the next step relies on what that step is expected to be.
Outcome ContactSearch::finish_reached(Vec displacement, double accuracy, int64_t& iterations) {
  constexpr int max_finer = 2;
  constexpr double finer = 0.25;
  Outcome outcome = finish(displacement, accuracy);
  double to = accuracy;
  for (int n = 0; n < max_finer && !outcome.converged && outcome.stable; ++n) {
    if (newton(displacement, to *= finer, iterations) != End::reached) break;
    outcome = finish(displacement, accuracy);
  }
  return outcome;
}

/// Releases points between bodies that overlap from one of them. Returns true if there are any.
/// Collective.
bool ContactSearch::release_overlapped(double accuracy) {
  discrete::Positions& positions = objective_.positions();
  mechanics::BodyContact& contact = objective_.body_contact();
  contact.update_gaps(positions.local());
  const bool any = base::on_any_rank(positions.comm(), contact.release_overlapped(accuracy));
  if (any) tangent_.forget_contact();
  return any;
}

/// Leads points between bodies that overlap out round an edge of one of them. Returns true if there
/// are any that have such a way. Collective.
bool ContactSearch::lead_out(Vec displacement, double accuracy) {
  discrete::Positions& positions = objective_.positions();
  objective_.evaluate(displacement, gradient_);
  subtract_contact();
  qp_.linearize(displacement);
  const auto ways = objective_.body_contact().ways_out(positions.local(), accuracy);
  if (!base::on_any_rank(positions.comm(), !ways.empty())) return false;
  for (const mechanics::LinearGap& way : ways) qp_.replace(way);
  const bool found = qp_.solve(displacement, slope_, predicted_to, step_);
  if (found) check(VecAXPY(displacement, 1.0, step_));
  tangent_.forget_contact();
  return found;
}

Outcome ContactSearch::stopped(Vec displacement, Outcome outcome) {
  outcome.converged = false;
  outcome.stopped = true;
  outcome.reason = stopped_reason;
  outcome.objective = objective_.evaluate(displacement, gradient_);
  outcome.gradient_max = discrete::largest_block(gradient_);
  return outcome;
}

/// True if a point presses on a body near an edge of it. Collective.
bool ContactSearch::presses_near_edge(Vec displacement) {
  discrete::Positions& positions = objective_.positions();
  positions.update(displacement);
  mechanics::BodyContact& contact = objective_.body_contact();
  contact.update_gaps(positions.local());
  return base::on_any_rank(positions.comm(), !contact.other_sides(positions.local()).empty());
}

/// Takes displacements of this rank's points as another rest position of a state of the skin: finds
/// the largest distance and its place. Collective.
OtherRest ContactSearch::compare_skins(Vec displacement, std::vector<Vec3> other) {
  discrete::Positions& positions = objective_.positions();
  const model::Points& points = positions.part().model.points;
  positions.update(displacement);
  OtherRest found;
  for (int64_t i = 0; i < positions.part().owned_points; ++i) {
    const double apart = (positions.local()[i] - points.position[i] - other[i]).norm();
    if (points.layer[i] != 0 || apart <= found.distance) continue;
    found.distance = apart;
    found.place = points.position[i];
  }
  found.distance = base::max_over_ranks_with(positions.comm(), found.distance, found.place);
  found.displacement = std::move(other);
  return found;
}

/// Returns the displacements of this rank's points in a state. Collective.
std::vector<Vec3> ContactSearch::displacements(Vec state) {
  discrete::Positions& positions = objective_.positions();
  positions.update(state);
  std::vector<Vec3> found(positions.part().owned_points);
  for (size_t i = 0; i < found.size(); ++i)
    found[i] = positions.local()[i] - positions.part().model.points.position[i];
  return found;
}

/// The latest value without its part of contact, N mm.
double ContactSearch::without_contact(double value) {
  return value - objective_.weights().elastic * objective_.contact_value();
}

/// Energy of the tissue and its loads without contact, N mm.
double ContactSearch::energy(Vec displacement) {
  return without_contact(objective_.evaluate(displacement, gradient_));
}

/// Searches for the rest position that quadratic programs lead to from the prediction, without
/// rounded bodies. Where it is another one, `displacement` becomes that of less energy, and
/// `outcome` states the distance to the other.
void ContactSearch::consider_other(Vec displacement, double accuracy, Outcome& outcome) {
  const ContactPressures here = pressures();
  const double value_here = objective_.evaluate(displacement, gradient_);
  set_pressures(at_prediction_);
  int64_t iterations = 0;
  bool taken = false;
  End end = newton(start_, accuracy, iterations);
  if (end == End::failed && !presolve(start_, accuracy).stopped)
    end = newton(start_, accuracy, iterations);
  if (end == End::reached) {
    OtherRest other = compare_skins(displacement, displacements(start_));
    const bool is_less = objective_.evaluate(start_, gradient_) < value_here;
    const bool is_other = other.distance > 2 * accuracy;
    Outcome there;
    if (is_other && is_less) there = finish_reached(start_, accuracy, iterations);
    taken = there.converged;
    there.iterations += outcome.iterations + iterations;
    if (taken) outcome = there;
    if (is_other && taken == is_less) {
      if (taken) other.displacement = displacements(displacement);
      outcome.other = std::move(other);
    }
  }
  if (taken)
    check(VecCopy(start_, displacement));
  else
    set_pressures(here);
}

/// Searches from `displacement` with one point beyond the other side of its body; ends in start_.
/// Fails where the augmented Lagrangian is no less there, which misses the energy by the square of
/// the gaps that are left. Collective; `side` is null on ranks that do not own the point.
ContactSearch::End ContactSearch::change_side(const OtherSide* side, Vec displacement,
                                              double accuracy) {
  // Of the work of the contact's force over the gap: after the program, which is not exact, and
  // after a further step.
  constexpr double promising = 0.4, still_promising = 0.1;
  constexpr double rounding = 1e-6;  // of the value
  check(VecCopy(displacement, start_));
  const double value_here = objective_.evaluate(start_, gradient_);
  const double energy_here = without_contact(value_here);
  subtract_contact();
  qp_.linearize(start_);
  double work = 0;
  if (side) {
    const mechanics::LinearGap& gap = side->gap;
    work = -gap.gap * gap.area * objective_.body_contact().multipliers()[gap.constraint];
    qp_.replace(gap);
  }
  work = base::max_over_ranks(objective_.positions().comm(), work);
  if (!qp_.solve(start_, slope_, predicted_to, step_)) return End::failed;
  check(VecAXPY(start_, 1.0, step_));
  if (energy(start_) > energy_here + promising * work) return End::failed;
  int64_t iterations = 0;
  End end = newton(start_, accuracy, iterations, 1);
  if (end == End::failed && energy(start_) <= energy_here + still_promising * work)
    end = newton(start_, accuracy, iterations);
  const double value = objective_.evaluate(start_, gradient_);
  const bool less = value < value_here - rounding * std::abs(value_here);
  return end == End::reached && !less ? End::failed : end;
}

/// Lets points that press near an edge of a body go round it, one at a time, where that ends at
/// less energy. The position that is left is the outcome's other one. Returns whether there was
/// one. Collective.
bool ContactSearch::change_sides(Vec displacement, double accuracy, Outcome& outcome) {
  constexpr int max_tried = 8;
  constexpr double none = std::numeric_limits<double>::infinity();
  discrete::Positions& positions = objective_.positions();
  objective_.evaluate(displacement, gradient_);
  const std::vector<OtherSide> sides = promising_sides(objective_, tangent_, displacement);
  size_t next = 0;
  bool changed = false;
  for (int n = 0; n < max_tried; ++n) {
    const ContactPressures here = pressures();
    const double softness = next < sides.size() ? sides[next].softness : none;
    const auto first = base::extreme_over_ranks(positions.comm(), softness, MPI_MINLOC);
    if (first.value == none) break;
    const bool mine = first.rank == base::rank(positions.comm());
    const End end = change_side(mine ? &sides[next++] : nullptr, displacement, accuracy);
    Outcome there;
    int64_t iterations = 0;
    if (end == End::reached) there = finish_reached(start_, accuracy, iterations);
    there.iterations += iterations;
    if (there.converged) {
      take_other(displacement, accuracy, there, outcome);
      changed = true;
    } else {
      set_pressures(here);
    }
    if (end == End::stopped) return false;
  }
  return changed;
}

/// Searches for rest positions of less energy than that of `displacement`, which it then becomes.
void ContactSearch::find_other(Vec displacement, double accuracy, Outcome& outcome) {
  constexpr int max_passes = 3;  // after a change, points that were left before may follow
  const int64_t evaluated = objective_.evaluations();
  consider_other(displacement, accuracy, outcome);
  for (int pass = 0; pass < max_passes; ++pass)
    if (!change_sides(displacement, accuracy, outcome)) break;
  objective_.evaluate(displacement, gradient_);
  evaluations_for_other_ += objective_.evaluations() - evaluated;
}

/// Takes start_, which ended in `there`, in place of `displacement`. Of this and the other rest
/// position so far, the one that is farther away is the outcome's other one.
void ContactSearch::take_other(Vec displacement, double accuracy, Outcome there, Outcome& outcome) {
  OtherRest other = compare_skins(start_, displacements(displacement));
  if (outcome.other) {
    OtherRest earlier = compare_skins(start_, std::move(outcome.other->displacement));
    if (earlier.distance > other.distance) other = std::move(earlier);
  }
  there.iterations += outcome.iterations;
  outcome = std::move(there);
  if (other.distance > 2 * accuracy) outcome.other = std::move(other);
  check(VecCopy(start_, displacement));
}

/// Leaves a saddle, unless its value is no less than that of the `latest` one, to which the search
/// may have returned. Collective.
bool ContactSearch::leave_lower_saddle(Vec displacement, double& latest) {
  constexpr double lower = 1e-6;  // of the value
  tangent_.forget_contact();
  const double value = objective_.evaluate(displacement, gradient_);
  if (!(value < latest - lower * std::abs(value))) return false;
  latest = value;
  return leave_saddle(objective_, solver_, displacement);
}

Outcome ContactSearch::run(Vec displacement, double accuracy) {
  constexpr int max_rounds = 8, max_left = 20, stiffest = 16;
  constexpr double steady = 0.98;  // ratio of the gaps that rounds leave where nothing closes them
  Outcome outcome;
  if (!predicted_) {
    outcome = finish(displacement, accuracy);
    if (outcome.converged) return outcome;
  }
  const bool may_have_other =
      std::exchange(predicted_, false) && finds_other_ && objective_.positions().load() == 1;
  at_prediction_ = pressures();
  check(VecCopy(displacement, start_));
  stiffen(1);
  int64_t iterations = 0;
  int left = 0;                                             // saddles
  double saddle = std::numeric_limits<double>::infinity();  // value at the latest of them
  bool needs_presolve = false, led_out = false;
  double missing = std::numeric_limits<double>::infinity();  // mm of gaps
  const auto leaves = [&] {
    needs_presolve = false;
    return left++ < max_left && leave_lower_saddle(displacement, saddle);
  };
  if (approach(displacement, accuracy, iterations) == End::stopped)
    return stopped(displacement, outcome);
  for (int round = 0; round < max_rounds;) {
    if (needs_presolve) {
      const Outcome near = presolve(displacement, accuracy);
      iterations += near.iterations;
      if (near.stopped) return stopped(displacement, outcome);
    }
    const End end = newton(displacement, accuracy, iterations);
    if (end == End::stopped) return stopped(displacement, outcome);
    if (end == End::failed && qp_.reduced() && leaves()) continue;
    outcome = end == End::reached ? finish_reached(displacement, accuracy, iterations)
                                  : finish(displacement, accuracy);
    if (outcome.converged) break;
    if (!outcome.stable && leaves()) continue;
    const double before = std::exchange(missing, violation());
    if (missing > steady * before) {
      const bool leads = !std::exchange(led_out, true) && lead_out(displacement, accuracy);
      if (leads || release_overlapped(accuracy)) {
        missing = std::numeric_limits<double>::infinity();
        needs_presolve = !leads;
        continue;
      }
    }
    needs_presolve = end != End::reached;
    stiffen(std::min(2 * times_, stiffest));
    ++round;
  }
  outcome.iterations += iterations;
  if (!outcome.converged && outcome.displacement_error > accuracy)
    outcome.reason = fmt::format("contact did not converge: {:.3g} mm of gaps remain", violation());
  outcome.overlapped = base::sum_over_ranks(objective_.positions().comm(),
                                            objective_.body_contact().count_released());
  if (outcome.converged && outcome.overlapped == 0 && may_have_other &&
      presses_near_edge(displacement))
    find_other(displacement, accuracy, outcome);
  return outcome;
}

Outcome ContactSearch::run_near(Vec displacement, double accuracy) {
  const base::VecHandle guess = objective_.positions().make_vector();
  check(VecCopy(displacement, guess));
  objective_.body_contact().restore_released();
  stiffen(1);
  int64_t iterations = 0;
  const End end = newton(displacement, accuracy, iterations);
  if (end == End::stopped) return stopped(displacement, {});
  if (end == End::reached) {
    Outcome outcome = finish_reached(displacement, accuracy, iterations);
    outcome.iterations += iterations;
    if (outcome.converged) return outcome;
  }
  set_pressures({});
  check(VecCopy(guess, displacement));
  Outcome outcome = run(displacement, accuracy);
  outcome.iterations += iterations;
  return outcome;
}

double penetration(discrete::Objective& objective) {
  mechanics::BodyContact& body_contact = objective.body_contact();
  const auto position = objective.positions().local();
  body_contact.update_gaps(position);
  double deepest = 0;
  for (const double gap : body_contact.gaps()) deepest = std::max(deepest, -gap);
  mechanics::CutFaceContact& cut_faces = objective.cut_face_contact();
  cut_faces.update_gaps(position);
  for (size_t w = 0; w < cut_faces.size(); ++w) deepest = std::max(deepest, -cut_faces.gap(w));
  return base::max_over_ranks(objective.positions().comm(), deepest);
}

}  // namespace repose::solve
