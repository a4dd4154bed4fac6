#pragma once
#include <vector>

#include "repose/discrete/tangent.h"

namespace repose::solve {

/// A point that presses on a body near an edge, and the gap that it would have from the side round
/// the edge.
struct OtherSide {
  mechanics::LinearGap gap;  ///< of this rank
  /// By how much softer than its neighborhood held still the point would have to be for the other
  /// side to have as much energy.
  double softness;
};

/// Returns the sides, of this rank's points, that may have less energy than those pressed on at
/// `displacement`, where the objective was updated last: in a model of one point, whose compliance
/// is a few times the inverse of its block of the Hessian. Softness ascends. Collective.
std::vector<OtherSide> promising_sides(discrete::Objective& objective, discrete::Tangent& tangent,
                                       Vec displacement);

}  // namespace repose::solve
