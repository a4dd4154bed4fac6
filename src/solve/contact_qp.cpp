#include "contact_qp.h"

#include <algorithm>
#include <cmath>

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

void ContactQp::begin(Vec displacement, Vec step) {
  check(VecSet(step, 0));
  check(VecSet(force_, 0));
  tangent_.assemble(displacement);
  if (diagonal_.empty()) {
    diagonal_.assign(solver_.positions().local().size(), Mat3::Zero());
    tangent_.visit_spd_blocks([&](int32_t p, int32_t q, const Mat3& block) {
      if (p == q) diagonal_[p] += block;
    });
  }
  gaps_.stiffen(diagonal_);
  gaps_.begin();
}

/// Minimizes the augmented Lagrangian of the present multipliers: Newton steps on its active sets,
/// with the least along each.
bool ContactQp::search(Vec displacement, Vec slope, double tolerance, Sets sets, Vec step) {
  constexpr int few = 2, all = 30;
  constexpr double coarse = 0.1, share_left = 0.1;  // of a linear system; of the step
  begin(displacement, step);
  bool full = false;  // the latest step was not shortened
  settled_ = false;
  for (int set = 0; set < (sets == Sets::few ? few : all) && !settled_; ++set) {
    const bool changed = gaps_.choose_active();
    settled_ = full && !changed;
    if (settled_) break;
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
    full = std::abs(share - 1) <= coarse;
    check(VecAXPY(step, share, direction_));
    check(VecAXPY(force_, share, change_));
    gaps_.move(share);
    const double moved = share * discrete::largest_block(direction_);
    settled_ = moved <= std::max(tolerance, share_left * discrete::largest_block(step));
  }
  gaps_.move_multipliers();
  return settled_ || sets == Sets::few;
}

bool ContactQp::solve(Vec displacement, Vec slope, double tolerance, Sets sets, Vec step) {
  const linear::CgInPlaceOfPreonly cg(solver_.krylov());
  const std::vector<double> multipliers = gaps_.multipliers();
  bool found = search(displacement, slope, tolerance, sets, step);
  reduced_ = !found;
  if (reduced_) {
    gaps_.set_multipliers(multipliers);
    gaps_.reduce_curvature();
    found = search(displacement, slope, tolerance, sets, step);
  }
  if (!found && tangent_.limit_slopes(true)) {
    gaps_.set_multipliers(multipliers);
    found = search(displacement, slope, tolerance, sets, step);
    tangent_.limit_slopes(false);
  }
  if (found) gaps_.give_multipliers();
  return found;
}

}  // namespace repose::solve
