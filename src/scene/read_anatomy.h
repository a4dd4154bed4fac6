#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// Reads the key anatomy and its landmarks, under their standard names. Refuses landmarks that
/// cannot be those of a head in LPS: left and right exchanged, RAS, one of a pair missing, an order
/// from above to below that no head has.
AnatomyPlan read_anatomy(const Value& value);

}  // namespace repose::scene
