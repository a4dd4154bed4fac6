#pragma once
#include <string>
#include <vector>

#include "repose/model/model.h"

namespace repose::app {

/// Returns the row of the closing table on bones that come through the skin between its points,
/// which contact keeps outside: the depth is that of places in the middle of the skin's edges and
/// triangles, and deeper than before the move by 0.3 mm. Empty without any. `now` [points] of the
/// `initial` skin, mm; the bones are those of `model`, moved.
std::string describe_bone_through_skin(const surface::Surface& initial,
                                       const std::vector<Vec3>& now, const model::Model& model);

/// Row of the closing table on the longest border of the skin that is solved, where its points,
/// `now`, have moved by a millimeter or more: what lies beyond is not in the model. Empty where
/// they have not. Throws what make_skin_mesh() throws.
std::string describe_moving_border(const surface::Surface& initial, const std::vector<Vec3>& now);

}  // namespace repose::app
