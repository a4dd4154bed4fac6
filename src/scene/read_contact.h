#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// The items of tissue.attach_regions or, all of them to slide, of teeth.
std::vector<AttachRegion> read_attach_regions(const Value& list);
std::vector<AttachRegion> read_teeth(const Value& list);

Contact read_contact(const Value& value);

}  // namespace repose::scene
