#pragma once
#include <vector>

#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// The items of a list of incisions in a tissue of so many layers.
/// Points of a curve: a list, or a file of landmarks; two at least.
std::vector<Vec3> read_path(const Value& value);

/// A cut along the lips through all layers.
Incision read_mouth(const Value& value, int layers);

std::vector<Incision> read_incisions(const Value& list, int layers);

}  // namespace repose::scene
