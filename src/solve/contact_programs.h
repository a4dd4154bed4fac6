#pragma once
#include "contact_qp.h"
#include "repose/solve/minimizer.h"

namespace repose::solve {

/// Sequential quadratic programming with contact (Nocedal & Wright 2006, chapter 18): steps of
/// programs, shortened until the augmented Lagrangian of the new multipliers decreases. All members
/// collective.
class ContactPrograms {
 public:
  ContactPrograms(discrete::Objective& objective, discrete::Tangent& tangent,
                  linear::TangentSolver& solver, Minimizer::Watch watch);

  void set_stiffness(double stiffness) { qp_.gaps().set_stiffness(stiffness); }  ///< N/mm³

  /// Finds the step from rest at `displacement` to rest at `load`, in `increment`. Returns whether
  /// there is one.
  bool predict(Vec displacement, double load, Vec increment);

  enum class End { reached, failed, stopped };
  /// Takes steps until those that follow lead less than a quarter of `accuracy` farther. Adds to
  /// `iterations`.
  End run(Vec displacement, double accuracy, int64_t& iterations);
  /// The same after the step of a program to a `displacement` that was evaluated last.
  End go_on(Vec displacement, double accuracy, int64_t& iterations, int max_steps = 12);
  /// Returns whether the latest program met negative curvature.
  bool reduced() const { return qp_.reduced(); }
  /// Length of a full step, or 0, and how far those that follow would lead, mm.
  struct Step {
    double length = 0, left = 0;
  };
  /// Returns the step that the latest run ended with; from then on 0.
  Step take_last_step() { return std::exchange(last_, {}); }

  /// Leaves a saddle, unless its value is no less than that of the `latest` one, to which the
  /// search may have returned.
  bool leave_lower_saddle(Vec displacement, double& latest);

  /// Evaluates the augmented Lagrangian, N mm.
  double evaluate(Vec displacement) {
    return value_ = objective_.evaluate(displacement, gradient_);
  }
  double value() const { return value_; }  ///< that was evaluated last; after run(), of its end
  /// N, largest block of the gradient that was evaluated last.
  double largest_force() const { return discrete::largest_block(gradient_); }
  /// Evaluates the energy of the tissue and its loads without contact, N mm.
  double evaluate_tissue(Vec displacement) { return without_contact(evaluate(displacement)); }
  /// The energy of `value`, the latest that was evaluated, without its part of contact, N mm.
  double without_contact(double value);
  /// Takes the gaps of at most `reach` mm at `displacement`, which was evaluated last.
  void linearize(Vec displacement, double reach = ContactGaps::farthest);
  /// A linearization, to which restore() goes back.
  struct Kept {
    ContactGaps::Kept gaps;
    base::VecHandle slope;
  };
  Kept keep();
  void restore(const Kept& kept);
  /// Takes the step of one program from the `displacement` of linearize(), with these gaps of
  /// bodies, of this rank, in place of those of the same constraints. Returns whether it has a
  /// minimum.
  bool step_with(std::span<const mechanics::LinearGap> gaps, Vec displacement);

 private:
  static Step after(double before, double length);
  void subtract_contact();
  bool solve(Vec displacement, double tolerance);
  double take_step(Vec displacement, double length, double tissue);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  linear::TangentSolver& solver_;
  ContactQp qp_;
  Minimizer::Watch watch_;
  double value_ = 0;
  Step last_;
  double reach_ = ContactGaps::farthest;             // mm, of gaps that the next step may close
  base::VecHandle gradient_, slope_, step_, trial_;  // slope_: the gradient without contact
};

}  // namespace repose::solve
