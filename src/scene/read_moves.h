#pragma once
#include <map>
#include <string>

#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

/// Sets Scene::moves, the whole motion of each bone: the entries of the list, in the order of the
/// file. `landmarks` are those that may be named, mm.
void read_moves(const Value& list, const std::map<std::string, Vec3>& landmarks, Scene& scene);

}  // namespace repose::scene
