#pragma once
#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "repose/mechanics/rigid_body.h"

/// Frictionless contact as an augmented Lagrangian (docs/theory/contact.md), on plain arrays like
/// the other terms: for each constraint of gap g, area a, multiplier p (N/mm²)
///     a/(2k) (max(0, p − k g)² − p²),
/// without the max where a point slides.
namespace repose::mechanics {

/// State of a constraint, per area: value (N/mm), pressure p − k g where it acts, and
/// −d(pressure)/dg.
struct Pressing {
  double value = 0, pressure = 0, stiffness = 0;
};
inline Pressing press(double gap, double multiplier, double stiffness, bool slides) {
  const double pressure = multiplier - stiffness * gap;
  const double before = multiplier * multiplier;
  if (!slides && !(pressure > 0)) return {-before / (2 * stiffness), 0, 0};
  return {(pressure * pressure - before) / (2 * stiffness), pressure, stiffness};
}

/// A gap to first order: gap + Σ gradient · d over points displaced by d, mm. It stays ≥ 0, or 0
/// where the point slides.
struct LinearGap {
  size_t constraint;  ///< row of the loop's multipliers
  bool slides;
  double area;                                             ///< mm²
  double gap;                                              ///< mm
  using Gradient = std::vector<std::pair<int32_t, Vec3>>;  ///< by point, ascending
  Gradient gradient;
  Gradient lumped;  ///< the same at few points, for preconditioners; empty: as `gradient`
};

/// Calls visit(p, q, block) for the blocks of weight · g gᵀ, p not after q.
template <class Visit>
void visit_products(const LinearGap::Gradient& g, double weight, Visit&& visit) {
  for (size_t i = 0; i < g.size(); ++i)
    for (size_t j = i; j < g.size(); ++j)
      visit(g[i].first, g[j].first, Mat3(weight * g[i].second * g[j].second.transpose()));
}

/// Points against rigid bodies. A distance changes by no more than its point moves, so that a
/// constraint is evaluated only where a lower bound of its gap lets it act.
class BodyContact {
 public:
  BodyContact() = default;
  /// `pairs` with local point numbers.
  BodyContact(const model::ContactPairs& pairs, double stiffness, std::vector<RigidBody> bodies);

  /// Forgets all positions and multipliers.
  void reset(double stiffness);

  const model::ContactPairs& pairs() const { return pairs_; }
  std::span<const double> multipliers() const { return multiplier_; }
  void set_multipliers(std::span<const double> p) { multiplier_.assign(p.begin(), p.end()); }
  std::vector<RigidBody>& bodies() { return bodies_; }
  double stiffness() const { return stiffness_; }
  void set_stiffness(double stiffness) { stiffness_ = stiffness; }

  /// Adds scale · gradient; returns the value, N·mm, unscaled.
  double add_gradient(std::span<const Vec3> position, double scale, std::span<Vec3> gradient);
  /// Evaluates the gaps that may act, for all functions below.
  void update_gaps(std::span<const Vec3> position);
  /// Evaluates all gaps: by the exact distance (RigidBody::outside) where RigidBody::lower_bound
  /// shows them to be above 1 mm and the point to be outside the body.
  void update_all_gaps(std::span<const Vec3> position);
  /// Evaluates one gap as update_all_gaps() does.
  double measure_gap(size_t c, std::span<const Vec3> position);
  /// Calls visit(point, block): the Hessian at the latest update, or a semidefinite relative.
  template <class Visit>
  void for_each_block(bool exact, Visit&& visit) const {
    for (const size_t c : acting_) visit(pairs_.point[c], block(c, exact, now(c)));
  }
  /// The gaps below `reach` mm, to first order about the positions; those above `smoothed_to` mm of
  /// points outside, without multipliers, may be those of the exact distance (RigidBody::outside).
  std::vector<LinearGap> linear_gaps(std::span<const Vec3> position, double reach,
                                     double smoothed_to = std::numeric_limits<double>::infinity());
  /// Takes gaps made by linear_gaps to where the bodies have moved since they were at `before`:
  /// each point stays beside the place of its body that it was beside.
  void carry(std::span<const Vec3> position, std::span<const RigidBody> before,
             std::vector<LinearGap>& gaps) const;
  /// Returns the bodies on which points press or slide near edges, ascending. At the latest update.
  std::set<int32_t> bodies_near_edges(std::span<const Vec3> position) const;
  /// Gaps to first order of points that press on a body near an edge of it, from the body's sides
  /// round that edge: negative, at most 3 mm, from planes more than 60° from the one pressed on,
  /// those of a constraint one after the other. At the latest update.
  std::vector<LinearGap> other_sides(std::span<const Vec3> position) const;
  /// Calls visit(point, block) for the curvature −a p ∇²φ of the multipliers at gaps just made.
  template <class Visit>
  void for_each_curvature(std::span<const LinearGap> gaps, bool exact, Visit&& visit) const {
    for (const LinearGap& g : gaps)
      if (const double p = multiplier_[g.constraint]; p != 0)
        visit(pairs_.point[g.constraint], block(g.constraint, exact, {0, p, 0}));
  }
  /// Gaps (mm; where they cannot act a lower bound) and pressures p − k g (N/mm²) at the latest
  /// update, [C].
  std::span<const double> gaps() const { return gap_; }
  double pressure(size_t c) const { return now(c).pressure; }
  const Vec3& normal(size_t c) const { return normal_[c]; }

  /// Returns true if a point of this rank is between two bodies whose surfaces face each other and
  /// overlap at the latest update, so that no place is outside both.
  bool any_overlapped() const { return !overlapped().empty(); }
  /// Releases a constraint of each such point: that on the latter body in the model, or the one
  /// that does not slide. Returns true if there are any. Of this rank.
  bool release_overlapped();
  /// Lets released constraints act again.
  void restore_released() { released_.assign(released_.size(), 0); }
  /// Gaps to first order, as those of other_sides(), of points that release_overlapped() would
  /// release: for each the least deep of its two bodies' sides round an edge, if there is one.
  std::vector<LinearGap> ways_out(std::span<const Vec3> position) const;
  /// Returns how many constraints are released, of this rank.
  int64_t count_released() const { return std::ranges::count(released_, char{1}); }

 private:
  bool released(size_t c) const { return released_[c] != 0; }
  bool slides(size_t c) const { return pairs_.binding[c] == model::Binding::slides; }
  bool face(size_t c, size_t d) const;
  std::vector<std::pair<size_t, size_t>> overlapped() const;
  double min_gap(size_t c, const Vec3& beside) const;  // mm, that it can have become
  /// mm, the distance of a point outside from which a gap above `smoothed_to` may be the exact one.
  double exact_from(size_t c, double smoothed_to) const {
    return std::max(0.0, smoothed_to + pairs_.offset[c]);
  }
  bool stays_above(double gap, size_t c, const Vec3& beside);
  Pressing now(size_t c) const {
    return released(c) ? Pressing{} : press(gap_[c], multiplier_[c], stiffness_, slides(c));
  }
  std::vector<LinearGap> gaps_round_edge(size_t c, std::span<const Vec3> position,
                                         double deepest = 3) const;
  void measure(size_t c, const Vec3& beside);
  bool measure_within(double reach, double smoothed_to, size_t c, const Vec3& beside);
  void set(size_t c, const Vec3& beside, const surface::Distance& distance);
  Mat3 block(size_t c, bool exact, const Pressing& pressing) const;

  model::ContactPairs pairs_;
  double stiffness_ = 1;
  std::vector<RigidBody> bodies_;
  std::vector<double> multiplier_;  // [C] N/mm²
  std::vector<char> released_;      // [C] does not act
  std::vector<Vec3> seen_;          // [C] where the point was beside its body when last evaluated
  std::vector<double> distance_;    // [C] mm, then, or a lower bound
  std::vector<double> gap_;         // [C] at the latest update
  std::vector<Vec3> normal_;        // [C] when last measured
  std::vector<Mat3> curvature_;     // [C] when last measured
  std::vector<size_t> acting_;      // at the latest update
};

}  // namespace repose::mechanics
