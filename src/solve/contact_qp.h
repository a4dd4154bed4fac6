#pragma once
#include <span>
#include <vector>

#include "repose/discrete/tangent.h"
#include "repose/linear/tangent_solver.h"

namespace repose::solve {

/// The quadratic program of a step of contact: minimizes ½ dᵀHd + bᵀd over d with
/// g + Σ ∇g · d ≥ 0 at every gap that is near, = 0 where a point slides (docs/theory/contact.md).
/// H is the exact Hessian of the tissue and the curvature −a p ∂²g of the gaps' multipliers. An
/// augmented Lagrangian on an active set: each linear solve, by the tangent solver, is followed by
/// a new set and new multipliers. The multipliers begin and end in the objective's loops.
class ContactQp {
 public:
  ContactQp(discrete::Objective& objective, discrete::Tangent& tangent,
            linear::TangentSolver& solver);

  void set_stiffness(double stiffness) { stiffness_ = stiffness; }  ///< K, N/mm³

  /// Takes the gaps at `displacement` to first order. Collective.
  void linearize(Vec displacement);
  /// Linearizes where bodies and fixed points move on to `load`: each point stays beside the place
  /// of its body that it is beside. `travel` [local points] mm, of fixed points. Collective.
  void linearize(Vec displacement, double load, std::span<const Vec3> travel);
  /// Takes a gap of a body, of this rank, in place of that of the same constraint. Not collective.
  void replace(const mechanics::LinearGap& by);
  /// Minimizes; `slope` is b, `step` receives d. Stops where a further set would change d and the
  /// gaps by less than `tolerance` mm, or less than a tenth of d's largest 3-vector. Where negative
  /// curvature is met, the gaps' curvature is reduced to its semidefinite part. Returns whether a
  /// minimum was reached. Collective.
  bool solve(Vec displacement, Vec slope, double tolerance, Vec step);
  /// True if the latest solve met negative curvature.
  bool reduced() const { return reduced_; }

 private:
  void add_gaps();
  void take_multipliers();
  void give_multipliers();
  bool choose_active();
  void set_blocks();
  double move_multipliers();
  /// Pressure p − K (g + ∇g · d), N/mm², that acts where it is positive or the point slides.
  double pressure(size_t k) const;
  double change(const mechanics::LinearGap& gap, std::span<const Vec3> moved) const;
  void add_pushes(std::span<const double> pressure, Vec to);
  double line_search(double slope, double curvature);
  bool minimize(Vec displacement, Vec slope, double tolerance, Vec step);
  bool search(Vec displacement, Vec slope, double tolerance, Vec step);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  linear::TangentSolver& solver_;
  double stiffness_;                        // K, N/mm³
  std::vector<mechanics::LinearGap> gaps_;  // of bodies, then of the sides of cuts
  size_t touching_ = 0;                     // of them, at bodies
  std::vector<double> multiplier_;          // [gaps] N/mm²
  std::vector<double> closed_;              // [gaps] mm, ∇g · d
  std::vector<double> closing_;             // [gaps] mm, the same of a direction
  std::vector<char> active_;                // [gaps]
  bool reduced_ = false;
  std::vector<discrete::Objective::Block> curvature_, convex_curvature_;
  std::vector<Vec3> moved_;  // [local points] a direction δ, mm
  base::VecHandle force_, left_, direction_, change_, response_;  // H d, −∇, δ, H δ, pushes
};

}  // namespace repose::solve
