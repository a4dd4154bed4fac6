#pragma once
#include <yaml-cpp/yaml.h>

#include <filesystem>

namespace repose::scene {

/// The one YAML document of a file. Throws InputError that begins with the file (and line:column)
/// for no file, a folder, a file that is no text, too large, empty, or not YAML.
YAML::Node read_yaml(const std::filesystem::path& file);

}  // namespace repose::scene
