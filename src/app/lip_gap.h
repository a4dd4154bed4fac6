#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"

namespace repose::app {

/// Returns how far parted lips are apart along `up`, a unit vector, in the middle of the mouth, in
/// one sentence with a blank after it. Empty without the landmarks stomion, upper_lip and
/// lower_lip, and where the skin is not parted within 8 mm of stomion. `initial` and `moved`
/// [points] of the skin, mm.
std::string describe_lips(const scene::Landmarks& landmarks, const Vec3& up,
                          const std::vector<Vec3>& initial, const std::vector<Vec3>& moved);

}  // namespace repose::app
