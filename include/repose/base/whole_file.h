#pragma once
#include <filesystem>
#include <string_view>

namespace repose::base {

/// Writes `bytes` to FILE.part and renames it to `file`, so that no half-written file is ever seen.
/// Throws InputError naming the file and the reason. Not collective.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace repose::base
