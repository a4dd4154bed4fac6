#pragma once
#include <vector>

#include "repose/discrete/objective.h"

namespace repose::solve {

/// Gives the pressure of each owned point, N/mm² in the first component, to the constraint of
/// contact that it is nearest to, as multiplier; all others are 0. Not collective.
void set_pressures(discrete::Objective& objective, const std::vector<Vec3>& pressure);

/// mm, the deepest that a point is inside a body, beyond its offset, or has passed the other side
/// of a cut, at the objective's last update. Collective.
double penetration(discrete::Objective& objective);

}  // namespace repose::solve
