#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// Reads a move in the words of surgery of the bone in row `bone`: rotations about its pivot, then
/// a translation, in the axes of the head (head_axes). Targets of overjet and overbite are reached
/// from where both jaws are by the moves so far.
RigidMotion read_clinical_move(const Value& value, const Scene& scene, std::size_t bone);

}  // namespace repose::scene
