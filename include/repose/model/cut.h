#pragma once
#include "repose/model/cut_path.h"
#include "repose/model/model.h"

namespace repose::model {

/// Parts the tissue of a model made by make_layers along a cut. Points on the path but its two tips
/// are doubled in layers 0 … cut.layers − 1, except bone points, which stay joined; the doubles
/// come at the end of the points, in the same column and layer, and belong to the left of the path.
/// A spring that lies in the cut becomes two, its stiffness shared in proportion to the prisms'
/// volume on either side, and so do the mass and the force of a doubled point. The edges of a solid
/// are made anew from its prisms, and what tension they carried besides is shared like that.
/// Positions and rest lengths stay as they are: where the tissue was in equilibrium, the tension
/// that crossed the cut now opens it. Returns the rows of the doubled points, the double second.
/// Throws InternalError where the columns are no path of edges.
std::vector<std::array<int64_t, 2>> cut_along(const Cut& cut, Model& model);

}  // namespace repose::model
