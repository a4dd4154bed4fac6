#pragma once
#include "repose/discrete/tangent.h"
#include "repose/solve/minimiser.h"

namespace repose::solve {

/// Finds the rest position under v = v_0 for every prism: an augmented Lagrangian (Hestenes 1969;
/// Powell 1969), each minimisation with the penalty volume term, whose target volumes
/// t = v_0 (1 + q/κ) carry the multipliers (pressures) q. κ grows where the error does not shrink;
/// the next load begins with the pressures but not with a large κ, which makes narrow curved
/// valleys far from rest that Newton's method crawls through. A large κ makes pressures of the
/// least displacement, so that Newton's method ends the search by balance: what is near enough in
/// mm need not be so in N/mm².
class ExactVolume : public RestSearch {
 public:
  static constexpr double tolerance = 1e-6;   ///< of |v/v_0 − 1|, every prism with a soft point
  static constexpr double on_the_way = 1e-3;  ///< the same at loads below 1

  /// `objective` has the penalty volume term, `tangent` is its Hessian, of which `solver` solves
  /// linear systems, `minimiser` minimises it.
  ExactVolume(discrete::Objective& objective, discrete::Tangent& tangent,
              linear::TangentSolver& solver, Minimiser& minimiser);
  Outcome run(Vec displacement, double accuracy) override;
  void go_back(Vec displacement) override;

 private:
  Outcome search(Vec displacement, double accuracy, double allowed);
  std::vector<double> multipliers() const;  // q of each prism of the loop, N/mm²
  void set_multipliers(const std::vector<double>& pressure, double weight);
  void balance(Vec displacement, Outcome& outcome);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  linear::TangentSolver& solver_;
  Minimiser& minimiser_;
  double first_weight_;               // κ at first, N/mm²
  double start_weight_;               // κ before the last search
  std::vector<double> start_target_;  // t before it, [prisms of the loop] mm³
  base::VecHandle before_, gradient_, correction_;
};

}  // namespace repose::solve
