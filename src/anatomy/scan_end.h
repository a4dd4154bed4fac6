#pragma once
#include <optional>

#include "repose/surface/triangle_tree.h"

namespace repose::anatomy {

/// Plane faces in which a surface was cut off where its scan ended. They have six vertices or more,
/// their area is at least 60 mm² and half of that of all triangles with their normal, and no vertex
/// lies in front of them.
class ScanEnd {
 public:
  explicit ScanEnd(const surface::Surface& surface);

  /// True if such a face lies within `reach` mm of a point of the scan.
  bool within(const Vec3& point, double reach) const;

 private:
  std::optional<surface::TriangleTree> faces_;  // nothing: there is none
};

}  // namespace repose::anatomy
