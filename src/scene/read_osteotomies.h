#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// Adds the osteotomies of the list and, as a bone of its own, the piece of each.
void read_osteotomies(const Value& list, Scene& scene);

}  // namespace repose::scene
