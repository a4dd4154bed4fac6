#pragma once
#include <vector>

#include "repose/discrete/positions.h"
#include "repose/mechanics/cut_face_contact.h"

namespace repose::discrete {

/// Pressures of contact of this rank's points, N/mm², a number a constraint: those on bodies, then
/// those between sides of cuts.
using ContactPressures = std::vector<double>;

/// Contact of the points that this rank owns: with bodies, which move with the positions' load, and
/// between the faces of cuts. Members are not collective unless said otherwise.
class Contact {
 public:
  explicit Contact(const Positions& positions);  ///< collective

  mechanics::BodyContact& bodies() { return bodies_; }
  mechanics::CutFaceContact& cut_faces() { return cut_faces_; }
  /// Rounds the edges of cuts, and of bodies whose distances are read from grids, or no more. The
  /// multipliers are kept.
  void round_edges(bool rounded);
  double stiffness() const { return bodies_.stiffness(); }  ///< N/mm³
  void set_stiffness(double stiffness);
  size_t size() const { return bodies_.gaps().size() + cut_faces_.size(); }  ///< constraints
  ContactPressures multipliers() const;
  void set_multipliers(ContactPressures to);  ///< those that are missing are 0
  /// Evaluates the gaps that may act at the positions' state, of bodies where they are placed.
  void update_gaps();
  ContactPressures pressures() const;  ///< at the latest update
  std::vector<double> gaps() const;    ///< mm [constraints], at the latest update
  /// Gives the pressure of each owned point, N/mm², to the constraint that it is nearest to, as
  /// multiplier; all others are 0.
  void set_pressures(const std::vector<double>& pressure);
  /// Returns by how much pressures at the positions' last update differ from multipliers, over the
  /// stiffness, mm: the gap where a point presses or slides, what a multiplier still pretends where
  /// it does not. Collective.
  double violation();
  /// mm, the deepest that a point is inside a body, beyond its offset, or has passed the other side
  /// of a cut, at the positions' last update. Collective.
  double penetration();
  /// Takes the bodies to where they are at the positions' load.
  void place_bodies();
  /// Goes back to the state after construction.
  void reset();

  /// Returns this rank's value, N·mm, and adds `scale` times its derivative to `gradient` [local
  /// points].
  double add_gradient(double scale, std::span<Vec3> gradient);
  /// Calls visit(p, q, block) for the second derivatives, exact or of a semidefinite relative.
  template <class Visit>
  void for_each_block(bool exact, Visit&& visit) {
    if (!positions_.part().contact) return;
    place_bodies();
    update_gaps();
    bodies_.for_each_block(exact, [&](int64_t p, const Mat3& block) { visit(p, p, block); });
    cut_faces_.for_each_block(exact, visit);
  }

 private:
  const Positions& positions_;
  mechanics::BodyContact bodies_, other_bodies_;  // those in use, and the others
  mechanics::CutFaceContact cut_faces_, other_cut_faces_;
  bool rounded_ = false;    // those in use are
  int64_t placed_at_ = -1;  // positions' revision at which bodies are
};

}  // namespace repose::discrete
