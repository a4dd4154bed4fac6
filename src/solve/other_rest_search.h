#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "contact_descent.h"

namespace repose::solve {

struct OtherSide;

/// Finds other rest positions of tissue that presses or slides on bodies near edges of these
/// (docs/theory/contact.md): by programs without rounded bodies from where tissue rests among
/// bodies that hardly resist; then with single points on the other side of the edge that they press
/// near. All members collective.
class OtherRestSearch {
 public:
  OtherRestSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                  ContactPrograms& programs, ContactDescent& descent);

  /// Keeps a prediction, from which tissue comes to rest among bodies that hardly resist.
  void begin(Vec prediction);
  /// Searches for rest positions of less energy than that of `displacement`, which it then becomes,
  /// with its `outcome`, which states the distance to the other.
  void find(Vec displacement, double accuracy, Outcome& outcome);
  int64_t evaluations() const { return evaluations_; }  ///< by all calls of find()

 private:
  using End = ContactPrograms::End;
  struct Candidate {  ///< another rest position that programs reached
    base::VecHandle displacement;
    discrete::ContactPressures pressures;
  };
  std::vector<int32_t> touched_near_edges(Vec displacement);
  int64_t pierced(Vec state);
  Outcome settle(Vec displacement, double accuracy);
  void consider(Vec displacement, const discrete::ContactPressures& here, double accuracy,
                Outcome& outcome);
  struct Rest {            ///< at the position that sides are changed from
    double value, energy;  ///< N mm, with contact and without
    ContactPrograms::Kept linear;
  };
  Rest linearize(Vec displacement);
  End change_side(const OtherSide* side, Vec displacement, const Rest& rest, double accuracy);
  bool change_sides(Vec displacement, double accuracy, std::set<size_t>& tried, Outcome& outcome);
  bool descend(Vec displacement, double accuracy, Outcome& outcome);
  void try_candidate(Vec displacement, double accuracy, Outcome& outcome);
  void take_other(Vec displacement, double accuracy, Outcome there, Outcome& outcome);
  void keep_farther(OtherRest other, Outcome& outcome);
  OtherRest compare_skins(Vec displacement, std::vector<Vec3> other);
  std::vector<Vec3> displacements(Vec state);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  ContactPrograms& programs_;
  ContactDescent& descent_;
  int64_t evaluations_ = 0;
  base::VecHandle prediction_, start_;
  std::optional<Candidate> candidate_;
};

}  // namespace repose::solve
