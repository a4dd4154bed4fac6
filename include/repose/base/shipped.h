#pragma once
#include <filesystem>
#include <string>

namespace repose::base {

/// A folder that comes with the programs, such as "meshes", wherever they are called from: the one
/// here, else where they are installed (PREFIX/bin → PREFIX/share/repose), else in the project they
/// were built in. Where there is none, its name as it is. Not collective.
std::filesystem::path shipped_folder(const std::string& name);

}  // namespace repose::base
