#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "value.h"

/// Names of bones in a scene file.
namespace repose::scene {

/// A name that no bone has yet: see is_bone_name().
std::string read_new_name(const Value& value, const std::vector<BoneEntry>& bones);

/// The row of the bone named so among at least one; `value` is refused, with the nearest name,
/// where there is none.
std::size_t find_bone(const std::string& name, const Value& value,
                      const std::vector<BoneEntry>& bones);

}  // namespace repose::scene
