#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

/// Adds the crease between the lips of a scene with landmarks, found on a skin, as its mouth; where
/// they are apart, keeps the middle of the gap in its plan. Leaves a mouth of the scene's own.
/// Throws InputError where no crease is found.
void part_lips(const surface::Surface& skin, scene::Scene& scene,
               std::vector<std::string>& remarks);

}  // namespace repose::anatomy
