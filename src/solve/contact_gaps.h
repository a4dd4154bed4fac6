#pragma once
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "repose/discrete/objective.h"

namespace repose::solve {

/// Gaps of contact to first order, g + Σ ∇g · d, with a penalty on them: the augmented Lagrangian
/// whose minimum over d is a step of contact (docs/theory/contact.md). Multipliers begin as the
/// objective's.
class ContactGaps {
  struct State;

 public:
  using Blocks = std::vector<discrete::Objective::Block>;
  using Kept =
      std::tuple<std::vector<mechanics::LinearGap>, size_t, std::vector<State>, Blocks, Blocks>;

  explicit ContactGaps(discrete::Objective& objective);

  void set_stiffness(double stiffness) { stiffness_ = least_stiffness_ = stiffness; }  ///< K, N/mm³
  /// Takes four times the stiffness, of at most 64 times the one that was set. Not collective.
  void stiffen();
  void relax() { stiffness_ = least_stiffness_; }  ///< to the stiffness that was set

  static constexpr double farthest = 5;  ///< mm: gaps beyond do not close in a step

  /// Takes the gaps at `displacement` of at most `reach` mm. Collective.
  void linearize(Vec displacement, double reach = farthest);
  /// Takes them where bodies and fixed points move on to `load`: each point stays beside the place
  /// of its body that it is beside. `travel` [local points] mm, of fixed points. Collective.
  void linearize(Vec displacement, double load, std::span<const Vec3> travel);
  /// Takes a gap of a body, of this rank, in place of that of the same constraint. Not collective.
  void replace(const mechanics::LinearGap& by);
  /// Keeps the gaps as linearize() took them, to which restore() goes back. Not collective.
  Kept keep() const { return {gaps_, touching_, state_, curvature_, convex_curvature_}; }
  void restore(const Kept& kept) {
    std::tie(gaps_, touching_, state_, curvature_, convex_curvature_) = kept;
    curvature_share_ = 1;
  }
  /// Keeps a share of the gaps' curvature, from 0 to 1, and of the rest the semidefinite part. Not
  /// collective.
  void keep_curvature(double share) { curvature_share_ = share; }

  /// Takes d = 0 and no active set. Not collective.
  void begin();
  /// Activates the gaps that press or slide. Returns whether the set has changed on any rank.
  /// Collective.
  bool choose_active();
  /// Second derivatives of the active gaps' terms: exact, and of the semidefinite relative.
  std::pair<Blocks, Blocks> blocks() const;
  /// Adds the forces −∂/∂d of the active gaps to `to`. Collective.
  void add_forces(Vec to);
  /// Takes δ as the direction in which d changes next. Collective.
  void set_direction(Vec direction);
  /// Takes changes of gaps, mm [constraints], in place of those by a direction. Not collective.
  void set_changes(std::span<const double> changes);
  /// Adds the forces that the active gaps have by the change of d by the direction. Collective.
  void add_change_of_forces(Vec to);
  /// Returns the share of the direction that leads to the least value, of a function with `slope`
  /// and `curvature` along it without the gaps. Collective.
  double line_search(double slope, double curvature) const;
  /// d changes by this share of the direction. Not collective.
  void move(double share);
  /// Takes pressures as multipliers. Returns the largest change, mm of gaps. Collective.
  double move_multipliers();

  std::vector<double> multipliers() const;
  void set_multipliers(const std::vector<double>& to);
  void give_multipliers();  ///< to the objective; not collective

 private:
  void add_gaps(double reach);
  /// Row of a gap in discrete::ContactPressures.
  size_t constraint(size_t k) const {
    const size_t before = k < touching_ ? 0 : objective_.contact().bodies().gaps().size();
    return before + gaps_[k].constraint;
  }
  /// Pressure p − K (g + ∇g · d), N/mm², that acts where it is positive or the point slides.
  double pressure(size_t k) const {
    return state_[k].multiplier - stiffness_ * (gaps_[k].gap + state_[k].closed);
  }
  /// Adds the forces of pressures, N/mm², on the active gaps: `of(k)`.
  template <class Pressure>
  void add_forces_of(Pressure&& of, Vec to);

  struct State {
    double multiplier = 0;    // N/mm²
    double closed = 0;        // mm, ∇g · d
    double closing = 0;       // mm, ∇g · δ
    signed char active = -1;  // not chosen yet
  };

  discrete::Objective& objective_;
  double stiffness_, least_stiffness_;
  std::vector<mechanics::LinearGap> gaps_;  // of bodies, then of the sides of cuts
  size_t touching_ = 0;                     // of them, at bodies
  std::vector<State> state_;                // [gaps]
  Blocks curvature_, convex_curvature_;
  double curvature_share_ = 1;  // of curvature_ in blocks(); the rest is of convex_curvature_
  std::vector<Vec3> moved_;     // [local points] δ, mm
  base::VecHandle forces_;
};

}  // namespace repose::solve
