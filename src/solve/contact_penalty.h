#pragma once
#include "repose/discrete/tangent.h"
#include "repose/solve/rest_search.h"

namespace repose::solve {

/// Multipliers and stiffness of the objective's contact, that of bodies and of the sides of cuts.
class ContactPenalty {
 public:
  ContactPenalty(discrete::Objective& objective, discrete::Tangent& tangent)
      : objective_(objective), tangent_(tangent) {}

  void set_stiffness(double stiffness);  ///< N/mm³; not collective
  discrete::ContactPressures multipliers() const { return objective_.contact().multipliers(); }
  void set_multipliers(const discrete::ContactPressures& to);  ///< those that are missing are 0
  /// Takes the pressures at the positions' last update as multipliers. Not collective.
  void move_multipliers();
  /// Returns by how much pressures at the positions' last update differ from multipliers, over the
  /// stiffness, mm: the gap where a point presses or slides, what a multiplier still pretends where
  /// it does not. Collective.
  double violation();

 private:
  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
};

/// Gives the pressure of each owned point, N/mm², to the constraint of contact that it is nearest
/// to, as multiplier; all others are 0. Not collective.
void set_pressures(discrete::Objective& objective, const std::vector<double>& pressure);

/// mm, the deepest that a point is inside a body, beyond its offset, or has passed the other side
/// of a cut, at the objective's last update. Collective.
double penetration(discrete::Objective& objective);

}  // namespace repose::solve
