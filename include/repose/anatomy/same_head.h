#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

/// Throws InputError where landmarks are not those of these surfaces: one lies more than 15 mm from
/// the skin or the bones that it is on by its name, one of the skin more than 40 mm from its
/// counterpart of bone, all of them lie nearer when they are moved by more than 4 mm together, or
/// the edges of the incisors lie on the bones of the other jaw. `bones` are whole.
void require_same_head(const scene::Landmarks& landmarks, const std::string& file,
                       const surface::Surface& skin, const std::vector<surface::Surface>& bones);

}  // namespace repose::anatomy
