#pragma once
#include <string>
#include <vector>

#include "repose/surface/surface.h"

namespace repose::app {

/// Row of the closing table on the longest border of the skin that is solved, where its points,
/// `now`, have moved by a millimeter or more: what lies beyond is not in the model. Empty where
/// they have not. Throws what make_skin_mesh() throws.
std::string describe_moving_border(const surface::Surface& initial, const std::vector<Vec3>& now);

}  // namespace repose::app
