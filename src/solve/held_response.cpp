#include "held_response.h"

#include <algorithm>

namespace repose::solve {

using base::check;

namespace {

constexpr double close = 1e-4;  // relative change of rounds
constexpr double exact = 1e-6;  // relative residual of the linear solves
constexpr double stiffer = 16;  // the penalty about what presses
constexpr double apart = 1;     // mm that what does not press would have to come nearer

}  // namespace

FrozenContact::FrozenContact(Problem& problem)
    : problem_(problem),
      stiffness_(problem.objective().contact().stiffness()),
      multipliers_(problem.objective().contact().multipliers()) {
  discrete::Contact& contact = problem.objective().contact();
  const auto position = problem.objective().positions().local();
  contact.bodies().update_all_gaps(position);
  contact.cut_faces().update_gaps(position);
  const double stiff = stiffer * stiffness_;
  discrete::ContactPressures frozen = contact.pressures();
  const std::vector<double> gaps = contact.gaps();
  for (size_t c = 0; c < frozen.size(); ++c)
    frozen[c] = frozen[c] != 0 ? frozen[c] + stiff * gaps[c] : stiff * (gaps[c] - apart);
  set(stiff, frozen);
}

FrozenContact::~FrozenContact() { set(stiffness_, multipliers_); }

void FrozenContact::set(double stiffness, const discrete::ContactPressures& multipliers) {
  discrete::Contact& contact = problem_.tangent().change_contact();
  contact.set_stiffness(stiffness);
  contact.set_multipliers(multipliers);
}

HeldResponse::HeldResponse(Problem& problem, Vec displacement)
    : frozen_(problem),
      solver_(problem.elastic_solver()),
      displacement_(displacement),
      gaps_(problem.objective()),
      left_(solver_.positions().make_vector()),
      change_(solver_.positions().make_vector()),
      product_(solver_.positions().make_vector()) {
  gaps_.set_stiffness(problem.objective().contact().stiffness());
  gaps_.linearize(displacement);
  gaps_.choose_active();
  solver_.refresh(displacement);
}

void HeldResponse::forces_of_gaps(std::span<const double> changes, Vec forces) {
  gaps_.set_changes(changes);
  check(VecSet(forces, 0));
  gaps_.add_change_of_forces(forces);
}

/// Solves H x = left_, which becomes what is left of it.
void HeldResponse::solve_once(Vec response, double tolerance) {
  convex_ = solver_.solve(displacement_, left_, response, tolerance);
  // Where iterations ran out, the next solve renews the preconditioner or takes factors.
  if (convex_ && !solver_.finished())
    convex_ = solver_.solve(displacement_, left_, response, tolerance);
  finished_ = solver_.finished();
  solver_.product_of_solution(left_, product_);
  check(VecAXPY(left_, -1.0, product_));
}

void HeldResponse::hold(Vec forces, Vec response, Vec earlier) {
  constexpr double coarse = 0.1;     // relative residual, at most
  constexpr double shrinking = 0.1;  // of a round's change, what the next one's is at most
  constexpr int max_rounds = 30;
  double size = discrete::largest_block(response), expected = shrinking * size;
  for (int round = 0; round < max_rounds; ++round) {
    check(VecCopy(forces, change_));
    gaps_.set_direction(response);
    gaps_.add_change_of_forces(change_);
    if (discrete::largest_block(change_) == 0) return;  // nothing presses
    check(VecAXPY(left_, 1.0, change_));
    check(VecAXPY(earlier, 1.0, response));
    solve_once(change_, expected > 0 ? std::clamp(exact * size / expected, exact, coarse) : exact);
    if (!succeeded()) return;
    check(VecAXPY(response, 1.0, change_));
    size = discrete::largest_block(response);
    expected = shrinking * discrete::largest_block(change_);
    if (expected <= close * size) return;
  }
  finished_ = false;
}

void HeldResponse::solve(Vec load, Vec forces, Vec response, Vec earlier) {
  const linear::CgInPlaceOfPreonly cg(solver_.krylov());
  check(VecSet(earlier, 0));
  check(VecCopy(load, left_));
  solve_once(response, exact);
  if (succeeded()) hold(forces, response, earlier);
  if (succeeded()) return;
  check(VecSet(response, 0));
  check(VecSet(earlier, 0));
}

}  // namespace repose::solve
