#pragma once
#include "repose/scene/scene.h"
#include "repose/surface/read.h"

namespace repose::model {

/// The surface that an entry of a scene names: a mesh as it is, or the largest component taken from
/// a volume, fit for its role. Throws InputError naming the file.
surface::Surface load_entry(const scene::SurfaceEntry& entry, surface::Role role);

}  // namespace repose::model
