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

}  // namespace repose::app
