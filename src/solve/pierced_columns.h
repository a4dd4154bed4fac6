#pragma once
#include "repose/discrete/objective.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// Finds columns whose deepest segment is inside a bone between its two points: nine samples of the
/// signed distance along it, deeper than 1.2 mm at the objective's last update and not so
/// initially. Finds prisms above the deepest, too, that a bone is deeper in than 0.6 mm between
/// their columns. Needs the model's contact with bones; without it nothing is found. Collective.
PiercedColumns find_pierced_columns(discrete::Objective& objective);

/// Finds columns with free points that are inside an instrument at a point, or at one of at least
/// nine samples between two consecutive points: deeper than 0.5 mm, or half of the instrument's
/// depth, at the objective's last update, where no sample of the column was so initially. Finds
/// prisms, too, between whose columns a smaller instrument is. Needs the model's contact with
/// instruments; without it nothing is found. Collective.
PiercedColumns find_columns_in_instruments(discrete::Objective& objective);

}  // namespace repose::solve
