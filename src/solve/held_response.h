#pragma once
#include <vector>

#include "contact_gaps.h"
#include "repose/solve/problem.h"

namespace repose::solve {

/// Keeps the active set of contact while it lives: a constraint that presses has its pressure at
/// the present gap and a stiffer penalty about it, and the others are off.
class FrozenContact {
 public:
  explicit FrozenContact(Problem& problem);
  ~FrozenContact();
  FrozenContact(FrozenContact&&) = delete;

 private:
  void set(double stiffness, const discrete::ContactPressures& multipliers);

  Problem& problem_;
  double stiffness_;
  discrete::ContactPressures multipliers_;
};

/// Solves linear systems with the Hessian at a rest position under the constraint that closed gaps
/// stay closed, by rounds of an augmented Lagrangian with the penalty K (docs/theory/plan.md).
/// Contact is frozen while it lives.
class HeldResponse {
 public:
  HeldResponse(Problem& problem, Vec displacement);  ///< collective

  /// −K ∇gᵀ c, N, of changes c of the gaps that the response is to undo, mm [constraints].
  /// Collective.
  void forces_of_gaps(std::span<const double> changes, Vec forces);
  /// Solves H x = load with ∇g · x = −c, of which load has the −K ∇gᵀ c in `forces`; 0 where that
  /// fails. `earlier` is the sum of the iterates before the last one: ∇g K (earlier + x) is what
  /// holds. Collective.
  void solve(Vec load, Vec forces, Vec response, Vec earlier);
  bool finished() const { return finished_; }
  bool convex() const { return convex_; }
  bool succeeded() const { return finished_ && convex_; }

 private:
  void solve_once(Vec response, double tolerance);
  void hold(Vec forces, Vec response, Vec earlier);

  FrozenContact frozen_;
  linear::TangentSolver& solver_;
  Vec displacement_;
  ContactGaps gaps_;
  base::VecHandle left_, change_, product_;
  bool finished_ = false, convex_ = false;
};

}  // namespace repose::solve
