#pragma once
#include <vector>

#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// The items of a list of instruments.
std::vector<Instrument> read_instruments(const Value& list);

}  // namespace repose::scene
