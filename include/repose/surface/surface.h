#pragma once
#include <string>
#include <vector>

#include "repose/base/geometry.h"

/// Triangle surfaces as the other rooms use them: plain arrays, nothing of CGAL.
namespace repose::surface {

/// An indexed triangle surface. Points in mm; triangles counter-clockwise seen from outside.
struct Surface {
  std::string name;                 ///< for messages: a file path or a bone's name
  std::vector<Vec3> points;         ///< [P] mm
  std::vector<Triangle> triangles;  ///< [T] 0-based rows of points
};

}  // namespace repose::surface
