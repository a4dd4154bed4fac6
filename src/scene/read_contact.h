#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// A part of space, given by exactly one of the keys sphere, mesh, volume (with label) and curve
/// (with radius) of an item.
Region read_region(const Map& map);

/// The items of tissue.attach_regions or, all of them to slide, of teeth.
std::vector<AttachRegion> read_attach_regions(const Value& list);
std::vector<AttachRegion> read_teeth(const Value& list);

Contact read_contact(const Value& value);

}  // namespace repose::scene
