#include "repose/solve/sensitivity.h"

#include <utility>

#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/discrete/natural_rows.h"
#include "repose/model/motion.h"
#include "repose/solve/problem.h"

namespace repose::solve {

using base::check;
using model::PointSet;

namespace {

/// `model` with all that is fixed held at `position` at load 1.
model::Model held_at(model::Model model, const std::vector<Vec3>& position) {
  model::Points& points = model.points;
  for (size_t i = 0; i < position.size(); ++i) {
    if (points.set[i] == PointSet::soft_tissue) continue;
    points.set[i] = PointSet::held;
    points.target[i] = position[i];
  }
  return model;
}

/// [N] mm from `position` to where a model has fixed points at load 1; 0 for the others.
std::vector<Vec3> travel_of_fixed(const model::Model& model, const std::vector<Vec3>& position) {
  const model::PrescribedMotion motion(model);
  std::vector<Vec3> travel(position.size(), Vec3::Zero());
  for (size_t i = 0; i < travel.size(); ++i)
    if (model.points.set[i] != PointSet::soft_tissue)
      travel[i] = motion.at(model, static_cast<int64_t>(i), 1) - position[i];
  return travel;
}

/// Contact as it is at rest, at the positions' state. Collective.
void bring_to_contact(const discrete::NaturalRows& natural, const RestState& rest,
                      Problem& problem) {
  discrete::Objective& objective = problem.objective();
  const MPI_Comm comm = objective.positions().comm();
  std::vector<double> pressure = rest.pressure;
  if (base::rank(comm) == 0) pressure.resize(rest.position.size(), 0.0);
  objective.contact().set_pressures(natural.owned(base::scatter(comm, pressure)));
  problem.tangent().invalidate();
}

/// Lets points press that a step takes into bodies, and those go that it takes off them; whether
/// there are any. Collective.
bool flip_contacts(Problem& problem, Vec displacement, Vec step) {
  discrete::Positions& positions = problem.objective().positions();
  mechanics::BodyContact& body_contact = problem.objective().contact().bodies();
  const double stiffness = body_contact.stiffness(), slight = 1e-9 * stiffness;
  const auto gaps_at = [&](Vec state) {
    positions.update(state);
    body_contact.update_all_gaps(positions.local());
    return std::vector<double>(body_contact.gaps().begin(), body_contact.gaps().end());
  };
  base::VecHandle moved = positions.make_vector();
  check(VecWAXPY(moved, 1.0, displacement, step));
  const std::vector<double> after = gaps_at(moved), before = gaps_at(displacement);
  std::vector<double> multiplier(body_contact.multipliers().begin(),
                                 body_contact.multipliers().end());
  bool flipped = false;
  for (size_t c = 0; c < multiplier.size(); ++c) {
    if (body_contact.pairs().binding[c] == model::Binding::slides) continue;
    const bool pressed = multiplier[c] > stiffness * before[c],
               presses = multiplier[c] > stiffness * after[c];
    if (presses == pressed) continue;
    multiplier[c] = stiffness * before[c] + (presses ? slight : 0);
    flipped = true;
  }
  body_contact.set_multipliers(multiplier);
  flipped = base::on_any_rank(positions.comm(), flipped);
  if (flipped) problem.tangent().invalidate();
  return flipped;
}

/// −∇Φ − H_sb Δx_b, into `force`.
void load_on(Problem& problem, Vec displacement, const std::vector<Vec3>& travel, Vec force) {
  discrete::Objective& objective = problem.objective();
  const discrete::Part& part = objective.positions().part();
  base::VecHandle gradient = objective.positions().make_vector();
  objective.evaluate(displacement, gradient);
  std::vector<Vec3> direction(part.point_row.size());
  for (size_t i = 0; i < direction.size(); ++i) direction[i] = travel[part.point_row[i]];
  objective.hessian_action(direction, force);
  check(VecAXPBY(force, -1.0, -1.0, gradient));
}

}  // namespace

std::vector<Vec3> first_order_change(MPI_Comm comm, const model::Model& other,
                                     const mechanics::Weights& weights, const RestState& rest) {
  constexpr double close = 1e-3;  // relative residual
  constexpr int contact_rounds = 4;
  model::Model held;
  std::vector<Vec3> travel;
  base::on_root(comm, [&] {
    held = held_at(other, rest.position);
    travel = travel_of_fixed(other, rest.position);
  });
  const discrete::Part part = discrete::build_local_from_root(comm, held).part;
  discrete::Positions positions(comm, part);
  const discrete::NaturalRows natural(comm, part);
  base::broadcast(comm, travel);
  const base::VecHandle displacement = positions.make_vector(), force = positions.make_vector(),
                        step = positions.make_vector();
  natural.set_unknowns(base::scatter(comm, rest.position), positions, displacement);
  positions.set_load(1);
  Problem problem(positions, weights, false);
  problem.function().evaluate(displacement, force);
  if (part.contact) bring_to_contact(natural, rest, problem);
  for (int left = contact_rounds; left > 0; --left) {
    load_on(problem, displacement, travel, force);
    linear::TangentSolver& solver = problem.solver();
    if (!solver.solve(displacement, force, step, close) || !solver.finished()) return {};
    if (!part.contact || !flip_contacts(problem, displacement, step)) break;
  }
  std::vector<Vec3> change(part.point_row.size());
  for (size_t i = 0; i < change.size(); ++i) change[i] = travel[part.point_row[i]];
  positions.scatter_to_local(step, change);
  return base::gather(comm, natural.natural(change));
}

}  // namespace repose::solve
