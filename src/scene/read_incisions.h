#pragma once
#include <vector>

#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// The items of a list of incisions in a tissue of so many layers.
std::vector<Incision> read_incisions(const Value& list, int layers);

}  // namespace repose::scene
