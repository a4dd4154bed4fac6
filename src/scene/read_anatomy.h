#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// Reads the key anatomy and its landmarks, under their standard names. Refuses landmarks that
/// cannot be those of a head in LPS: left and right exchanged, RAS, one of a pair missing, an order
/// from above to below that no head has.
AnatomyPlan read_anatomy(const Value& value);

/// Reads anatomy.septum, if there, into the first region of the scene's material: the septum's free
/// edges between the landmarks of `scene.anatomy`. Adds a remark. Throws InputError for springs and
/// where one of these landmarks is missing.
void read_septum(const Value& anatomy, Scene& scene);

}  // namespace repose::scene
