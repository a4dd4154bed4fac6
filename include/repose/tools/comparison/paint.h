#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "repose/surface/triangle_tree.h"

namespace repose::tools::comparison {

/// Regions painted on a mesh of the skin: by the colors of its vertices, or by the whole numbers of
/// their property `label`.
class Paint {
 public:
  /// A PLY. Colors that hold less than 1/200 of the vertices, and those within 40 (of 255) of a
  /// more frequent one, are blends of a brush and count as the nearest paint. Throws InputError
  /// where the vertices have neither colors nor a label.
  explicit Paint(const std::filesystem::path& file);

  /// All paints, the most frequent first: "color 255 0 0" or "label 3".
  const std::vector<std::string>& names() const { return names_; }
  /// Row of the paint at the vertex nearest to a point, which may be 10 mm off; −1 farther away.
  int at(const Vec3& point) const;

 private:
  std::vector<std::string> names_;
  std::vector<int> paint_;                     // [vertices] row of names
  std::optional<surface::TriangleTree> tree_;  // of the vertices
};

}  // namespace repose::tools::comparison
