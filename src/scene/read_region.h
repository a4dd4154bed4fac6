#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// A part of space, given by exactly one of the keys sphere, box, mesh, volume (with label) and
/// curve (with radius) of an item.
Region read_region(const Map& map);

/// Reads a region, or with the key painted the painted part of a mesh of the skin.
SkinRegion read_skin_region(const Map& map);

Box read_box(const Map& map);

}  // namespace repose::scene
