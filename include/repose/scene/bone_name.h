#pragma once
#include <string_view>

namespace repose::scene {

/// Returns whether a text may name a bone or a piece: 1 to 64 printable ASCII characters without
/// '/', for names of files end in it.
bool is_bone_name(std::string_view text);

}  // namespace repose::scene
