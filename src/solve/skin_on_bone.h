#pragma once
#include "repose/discrete/objective.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// Finds points of the skin that press on a bone at the objective's last update. Collective.
SkinOnBone find_skin_on_bone(discrete::Objective& objective);

}  // namespace repose::solve
