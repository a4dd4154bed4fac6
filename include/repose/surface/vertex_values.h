#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

namespace repose::surface {

/// A PLY file's vertices with all that is stored at them: colors, masks, what an editor painted.
struct VertexValues {
  std::vector<Vec3> points;                 ///< [P] mm
  std::vector<std::string> names;           ///< of the properties besides x, y and z
  std::vector<std::vector<double>> values;  ///< [names][P]

  /// Values of the property; nullptr if there is none of that name.
  const std::vector<double>* find(const std::string& name) const;
};

/// Reads them. Throws InputError naming the file where it is missing, no PLY, truncated or damaged.
VertexValues read_vertex_values(const std::filesystem::path& file);

}  // namespace repose::surface
