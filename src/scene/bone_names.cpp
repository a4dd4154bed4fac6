#include "bone_names.h"

#include <algorithm>

#include "repose/base/text.h"

namespace repose::scene {

std::string read_new_name(const Value& value, const std::vector<BoneEntry>& bones) {
  std::string name = value.text();
  const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (name.size() > 64 || !std::all_of(name.begin(), name.end(), printable))
    value.refuse("{} must be printable ASCII, 64 characters at most", base::quote(name));
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
