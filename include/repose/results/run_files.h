#pragma once
#include <string>
#include <vector>

namespace repose::results {

/// Endings, after NAME, of the names of a run's files.
inline constexpr const char* given_skin_ending = "_given_skin.vtp";
inline constexpr const char* checkpoint_suffix = "_checkpoint";  ///< before an ending

/// Returns the ending, after NAME, of the XDMF file of a view.
std::string view_ending(const std::string& view);

/// The view that holds the blocks of all others by name.
inline constexpr const char* named_view = "blocks";

/// Returns the endings, after NAME, of all files that a run may write.
std::vector<std::string> run_file_endings();

}  // namespace repose::results
