#pragma once
#include "repose/discrete/tangent.h"
#include "repose/solve/minimiser.h"

namespace repose::solve {

/// Finds the rest position of tissue that touches bodies and itself: an augmented Lagrangian
/// (Hestenes 1969; Powell 1969; Simo & Laursen 1992 for contact), minimisation after minimisation,
/// the multipliers moved to the pressures of each, until what passes or lifts off is below the
/// accuracy. The first are rough and their penalty is soft: then few points change sides at once.
/// The multipliers of a load are where the next begins.
class ContactSearch : public RestSearch {
 public:
  /// `tangent` is the objective's Hessian, `minimiser` minimises it.
  ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent, Minimiser& minimiser);
  Outcome run(Vec displacement, double accuracy) override;
  void go_back(Vec displacement) override;

 private:
  void set_stiffness(double stiffness);
  double violation();
  void move_multipliers();

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  Minimiser& minimiser_;
  double stiffness_;                           // N/mm³, of the model's contact
  std::vector<double> before_, walls_before_;  // multipliers before the last search
};

/// mm, the deepest that a point is inside a body, beyond its offset, or has passed the other side
/// of a cut, at the objective's last update. Collective.
double penetration(discrete::Objective& objective);

}  // namespace repose::solve
