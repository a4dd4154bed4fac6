#pragma once
#include <span>
#include <vector>

#include "repose/surface/triangle_tree.h"

namespace repose::surface {

/// A triangle that a line parallel to the x axis crosses.
struct LineCrossing {
  int64_t triangle;
  int winding;  ///< ±1, of the triangle's projection along x around the line: + where it faces +x
};

/// The crossings of the line through all (x, y, z), in the tree's order. Exact: a line through an
/// edge or a vertex is shifted by an infinitesimal amount, in the same way for all triangles, so
/// that a closed surface is crossed as often in one direction as in the other.
std::vector<LineCrossing> line_crossings(const TriangleTree& tree, double y, double z);

/// The winding number of the surface around a point of a line: the sum over the crossings beyond it
/// in +x. Exact where the point is not on the surface.
int winding_number(const TriangleTree& tree, std::span<const LineCrossing> crossings,
                   const Vec3& point);

}  // namespace repose::surface
