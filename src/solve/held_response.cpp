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
    : problem_(problem), stiffness_(body_contact().stiffness()) {
  const auto p = body_contact().multipliers(), q = cut_face_contact().multipliers();
  touch_multipliers_.assign(p.begin(), p.end());
  wall_multipliers_.assign(q.begin(), q.end());
  const auto position = problem.objective().positions().local();
  body_contact().update_all_gaps(position);
  cut_face_contact().update_gaps(position);
  const double stiff = stiffer * stiffness_;
  const auto frozen = [&](double pressure, double gap) {
    return pressure != 0 ? pressure + stiff * gap : stiff * (gap - apart);
  };
  std::vector<double> pressing(touch_multipliers_.size()), parting(wall_multipliers_.size());
  for (size_t c = 0; c < pressing.size(); ++c)
    pressing[c] = frozen(body_contact().pressure(c), body_contact().gaps()[c]);
  for (size_t w = 0; w < parting.size(); ++w)
    parting[w] = frozen(cut_face_contact().pressure(w), cut_face_contact().gap(w));
  set(stiff, pressing, parting);
}

FrozenContact::~FrozenContact() { set(stiffness_, touch_multipliers_, wall_multipliers_); }

void FrozenContact::set(double stiffness, std::span<const double> pressing,
                        std::span<const double> parting) {
  body_contact().set_stiffness(stiffness);
  cut_face_contact().set_stiffness(stiffness);
  body_contact().set_multipliers(pressing);
  cut_face_contact().set_multipliers(parting);
  problem_.tangent().forget_contact();
}

HeldResponse::HeldResponse(Problem& problem, Vec displacement)
    : frozen_(problem),
      solver_(problem.elastic_solver()),
      displacement_(displacement),
      gaps_(problem.objective()),
      left_(solver_.positions().make_vector()),
      change_(solver_.positions().make_vector()),
      product_(solver_.positions().make_vector()) {
  gaps_.set_stiffness(problem.objective().contact().bodies().stiffness());
  gaps_.linearize(displacement);
  gaps_.choose_active();
  solver_.refresh(displacement);
}

void HeldResponse::forces_of_gaps(std::span<const double> bodies, std::span<const double> cut_faces,
                                  Vec forces) {
  gaps_.set_changes(bodies, cut_faces);
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
