#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

/// Throws InputError where a landmark lies more than 15 mm from the skin or the bones that it is on
/// by its name.
void require_same_head(const scene::Landmarks& landmarks, const std::string& file,
                       const surface::Surface& skin, const std::vector<surface::Surface>& bones);

/// Completes a scene that names the landmarks of its head by what follows from them and from the
/// surfaces: the parting of the lips along their crease, and the vestibule, in which tissue touches
/// teeth and is not attached to them. What the scene says itself is kept. `bones` are whole or in
/// pieces. Adds lines for a person to `remarks`. Throws InputError where landmarks are not on these
/// surfaces.
void complete(const surface::Surface& skin, const std::vector<surface::Surface>& bones,
              scene::Scene& scene, std::vector<std::string>& remarks);

}  // namespace repose::anatomy
