#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// tissue.material: the preset, changed by the other keys.
Material read_material(const Value& value);

/// That of a scene that names neither material nor springs.
Material default_material();

}  // namespace repose::scene
