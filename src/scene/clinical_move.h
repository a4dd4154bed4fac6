#pragma once
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// Reads a move in the words of surgery of the bones in rows `bones`, one at least: one rigid
/// motion of all of them, rotations about the pivot of the first bone that has a default, then a
/// translation, in the axes of the head (head_axes). Targets of overjet and overbite are reached
/// from where both jaws are by the moves so far, by the first bone that has incisors. InputError
/// where the bone of the other incisors is unknown and may have moved, or moves along.
RigidMotion read_clinical_move(const Value& value, const Scene& scene,
                               const std::vector<std::size_t>& bones);

}  // namespace repose::scene
