#pragma once
#include <vector>

#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// The whole motion of each bone: the entries of `moves`, in the order of the file.
std::vector<RigidMotion> read_moves(const Value& moves, const std::vector<BoneEntry>& bones);

}  // namespace repose::scene
