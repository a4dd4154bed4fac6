#pragma once
#include <string>
#include <vector>

namespace repose::results {

/// What follows NAME in the names of files of a run.
inline constexpr const char* given_skin_ending = "_given_skin.vtp";
inline constexpr const char* checkpoint_suffix = "_checkpoint";  ///< before an ending

/// What follows NAME in the name of the XDMF file of a view.
std::string view_ending(const std::string& view);

/// The view that holds the blocks of all others by name.
inline constexpr const char* named_view = "blocks";

/// Returns what follows NAME in the names of all files that a run may write.
std::vector<std::string> run_file_endings();

}  // namespace repose::results
