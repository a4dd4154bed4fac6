#include "bone_names.h"

#include <algorithm>

#include "repose/base/text.h"
#include "repose/scene/bone_name.h"

namespace repose::scene {

bool is_bone_name(std::string_view text) {
  const auto allowed = [](char c) { return c >= ' ' && c <= '~' && c != '/'; };
  return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, allowed);
}

std::string read_new_name(const Value& value, const std::vector<BoneEntry>& bones) {
  std::string name = value.text();
  if (!is_bone_name(name))
    value.refuse("{} must be 1 to 64 printable ASCII characters without '/'", base::quote(name));
  for (const BoneEntry& other : bones)
    if (other.name == name)
      value.refuse("{} is the name of two bones; rename one", base::quote(name));
  return name;
}

std::size_t find_bone(const std::string& name, const Value& value,
                      const std::vector<BoneEntry>& bones) {
  const auto found = std::find_if(bones.begin(), bones.end(),
                                  [&](const BoneEntry& bone) { return bone.name == name; });
  if (found != bones.end()) return static_cast<std::size_t>(found - bones.begin());
  std::vector<std::string> names;
  for (const BoneEntry& bone : bones) names.push_back(bone.name);
  value.refuse("{} is no bone of the scene; the nearest is '{}'", base::quote(name),
               base::nearest(name, names));
}

}  // namespace repose::scene
