#pragma once
#include "contact_qp.h"
#include "contact_sides.h"
#include "repose/solve/minimizer.h"

namespace repose::solve {

/// Finds the rest position of tissue that touches bodies and itself (docs/theory/contact.md): the
/// step to a load is predicted with its contact by a quadratic program; a quasi-Newton search on
/// the augmented Lagrangian with a soft penalty comes near to the rest position among bodies with
/// rounded edges; sequential quadratic programs (Nocedal & Wright 2006, chapter 18) lead there, and
/// on to the bodies themselves, multipliers included. Where these fail, they are repeated after
/// finer soft searches, with a stiffer penalty; points between bodies that overlap are led out
/// round an edge, or released from one of them. The multipliers of a load are where the next
/// begins. At load 1, where points press near an edge of a body, quadratic programs start from the
/// prediction, too: where this ends elsewhere, the rest position of less energy is taken, and the
/// outcome states the distance of the other. Then single points are tried on the other side of the
/// edge that they press near.
class ContactSearch : public RestSearch {
 public:
  /// `tangent` is the objective's Hessian, `solver` solves with it, `minimizer` minimizes
  /// it.
  ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                linear::TangentSolver& solver, Minimizer& minimizer, Minimizer::Watch watch);
  /// Sets if another rest position is searched for at load 1 (the default).
  void find_other_rest(bool requested) { finds_other_ = requested; }
  /// Evaluations that this search took.
  int64_t evaluations_for_other() const { return evaluations_for_other_; }
  std::optional<bool> predict(Vec displacement, double load, Vec increment) override;
  Outcome run(Vec displacement, double accuracy) override;
  /// By quadratic programs alone, as long as they serve.
  Outcome run_near(Vec displacement, double accuracy) override;
  ContactPressures pressures() const override;
  void set_pressures(const ContactPressures& to) override;

 private:
  void set_stiffness(double stiffness);
  void stiffen(int times);
  double violation();
  void move_multipliers();
  void subtract_contact();
  Outcome search_softly(Vec displacement, double to, bool near, double& left);
  Outcome presolve(Vec displacement, double accuracy);
  enum class End { reached, failed, stopped };
  End approach(Vec displacement, double accuracy, int64_t& iterations);
  End newton(Vec displacement, double accuracy, int64_t& iterations, int max_steps = 12);
  /// Returns the share of the step that was taken, 0 for none.
  double take_step(Vec displacement, double length, double tissue, double& value);
  Outcome stopped(Vec displacement, Outcome outcome);
  Outcome finish(Vec displacement, double accuracy);
  Outcome finish_reached(Vec displacement, double accuracy, int64_t& iterations);
  bool release_overlapped(double accuracy);
  bool lead_out(Vec displacement, double accuracy);
  bool leave_lower_saddle(Vec displacement, double& latest);
  bool presses_near_edge(Vec displacement);
  double without_contact(double value);
  double energy(Vec displacement);
  void consider_other(Vec displacement, double accuracy, Outcome& outcome);
  End change_side(const OtherSide* side, Vec displacement, double accuracy);
  bool change_sides(Vec displacement, double accuracy, Outcome& outcome);
  void find_other(Vec displacement, double accuracy, Outcome& outcome);
  void take_other(Vec displacement, double accuracy, Outcome there, Outcome& outcome);
  OtherRest compare_skins(Vec displacement, std::vector<Vec3> other);
  std::vector<Vec3> displacements(Vec state);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  linear::TangentSolver& solver_;
  Minimizer& minimizer_;
  Minimizer::Watch watch_;
  ContactQp qp_;
  double stiffness_;  // N/mm³, of the penalty
  int times_ = 1;     // it is so many times the model's
  bool finds_other_ = true;
  int64_t evaluations_for_other_ = 0;
  double taken_ = 0;                // mm, the full step that the latest newton() ended with, or 0
  bool predicted_ = false;          // the next search begins with a prediction
  ContactPressures at_prediction_;  // of the latest search
  base::VecHandle gradient_, slope_, step_, trial_, start_;
};

/// mm, the deepest that a point is inside a body, beyond its offset, or has passed the other side
/// of a cut, at the objective's last update. Collective.
double penetration(discrete::Objective& objective);

}  // namespace repose::solve
