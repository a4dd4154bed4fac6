#include "contact_qp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace repose::solve {

using base::check;

ContactQp::ContactQp(discrete::Objective& objective, discrete::Tangent& tangent,
                     linear::TangentSolver& solver)
    : gaps_(objective),
      tangent_(tangent),
      solver_(solver),
      force_(objective.positions().make_vector()),
      left_(objective.positions().make_vector()),
      direction_(objective.positions().make_vector()),
      change_(objective.positions().make_vector()) {}

void ContactQp::set_blocks() {
  auto [exact, convex] = gaps_.blocks();
  tangent_.set_contact(std::move(exact), std::move(convex));
  solver_.preconditioner().update_contact();
}

/// Minimizes the augmented Lagrangian of the present multipliers from `step`: Newton steps on its
/// active sets, with the least along each.
bool ContactQp::minimize(Vec displacement, Vec slope, double tolerance, Vec step) {
  constexpr int max_sets = 30;
  constexpr double coarse = 0.05, share_left = 0.1;  // of a linear system; of the step
  bool full = false;                                 // the latest step was not shortened
  for (int set = 0; set < max_sets; ++set) {
    const bool changed = gaps_.choose_active();
    if (full && !changed) return true;
    if (changed) set_blocks();
    check(VecCopy(force_, left_));
    check(VecAXPY(left_, 1.0, slope));
    check(VecScale(left_, -1.0));
    gaps_.add_forces(left_);
    const bool convex = solver_.solve(displacement, left_, direction_, coarse);
    if (!convex || !solver_.finished()) return false;
    gaps_.set_direction(direction_);
    solver_.product_of_solution(left_, change_);
    gaps_.add_change_of_forces(change_);  // H δ without the stiffness of gaps
    PetscReal along = 0, curvature = 0, held = 0;
    check(VecDot(change_, direction_, &curvature));
    check(VecDot(force_, direction_, &along));
    check(VecDot(slope, direction_, &held));
    const double share = gaps_.line_search(along + held, curvature);
    full = std::abs(share - 1) <= share_left;
    check(VecAXPY(step, share, direction_));
    check(VecAXPY(force_, share, change_));
    gaps_.move(share);
    const double moved = share * discrete::largest_block(direction_);
    if (moved <= std::max(tolerance, share_left * discrete::largest_block(step))) return true;
  }
  return false;
}

/// Rounds of minimizations and new multipliers.
bool ContactQp::search(Vec displacement, Vec slope, double tolerance, Vec step) {
  constexpr int max_rounds = 3;  // the next program goes on with the multipliers
  constexpr double share = 0.1;  // of the step
  constexpr double slow = 0.6;   // ratio of the latest two changes of multipliers
  constexpr double near = 0.2;   // mm: with larger changes a stiffer penalty leads elsewhere
  double before = std::numeric_limits<double>::infinity();
  check(VecSet(step, 0));
  check(VecSet(force_, 0));
  gaps_.begin();
  tangent_.assemble(displacement);
  for (int round = 0; round < max_rounds; ++round) {
    if (!minimize(displacement, slope, tolerance, step)) return false;
    const double changed = gaps_.move_multipliers();
    if (changed <= std::max(tolerance, share * discrete::largest_block(step))) break;
    const bool falls = changed <= slow * std::exchange(before, changed);
    if (!falls && changed <= near) gaps_.stiffen();
  }
  return true;
}

bool ContactQp::solve(Vec displacement, Vec slope, double tolerance, Vec step) {
  const linear::CgInPlaceOfPreonly cg(solver_.krylov());
  const linear::EnergyTest energy(solver_.krylov());
  const std::vector<double> multipliers = gaps_.multipliers();
  constexpr std::array shares = {1.0, 0.7, 0.35, 0.0};  // of the gaps' curvature
  bool found = false;
  for (size_t k = 0; k < shares.size() && !found; ++k) {
    gaps_.set_multipliers(multipliers);
    gaps_.keep_curvature(shares[k]);
    found = search(displacement, slope, tolerance, step);
    reduced_ = !found || k > 0;
  }
  if (!found && tangent_.limit_slopes(true)) {
    gaps_.set_multipliers(multipliers);
    found = search(displacement, slope, tolerance, step);
    tangent_.limit_slopes(false);
  }
  if (found) gaps_.give_multipliers();
  return found;
}

}  // namespace repose::solve
