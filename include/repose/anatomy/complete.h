#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

/// Completes a scene that names the landmarks of its head by what follows from them and from the
/// surfaces: the parting of the lips along their crease, and the vestibule, in which tissue touches
/// teeth and is not attached to them. Keys that the scene sets itself are kept. Appends to
/// `remarks`. Throws InputError where no crease is found.
void complete(const surface::Surface& skin, scene::Scene& scene, std::vector<std::string>& remarks);

/// Fits the parting of the lips to the skin that is solved in place of the one that complete() was
/// given: where the lips were apart and that skin is closed, they are parted along the gap.
void fit_lips(const surface::Surface& skin, scene::Scene& scene, std::vector<std::string>& remarks);

}  // namespace repose::anatomy
