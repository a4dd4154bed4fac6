#pragma once
#include <optional>
#include <string>

#include "repose/scene/scene.h"

namespace repose::scene {

/// The row of the bone or piece on which a bony landmark of a standard name lies, by the scene
/// alone: of the lower jaw on "mandible", of the upper on "maxilla" or "skull", or on the only bone
/// beside the mandible, and on a piece of it where it lies in front of all of its planes. Nothing
/// for other landmarks, and where a cut by a surface, by a disc or with a seed leaves it open.
std::optional<std::size_t> carrying_bone(const Scene& scene, const std::string& landmark);

}  // namespace repose::scene
