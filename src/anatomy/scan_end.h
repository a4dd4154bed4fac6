#pragma once
#include <optional>

#include "repose/surface/triangle_tree.h"

namespace repose::anatomy {

/// The faces in which a surface was cut off where its scan ended: plane, at least 60 mm² large and
/// half of what faces that way, with all of the surface behind them.
class ScanEnd {
 public:
  explicit ScanEnd(const surface::Surface& surface);

  /// True if such a face lies within `reach` mm of a point of the scan.
  bool within(const Vec3& point, double reach) const;

 private:
  std::optional<surface::TriangleTree> faces_;  // nothing: there is none
};

}  // namespace repose::anatomy
