#pragma once
#include "repose/surface/edges.h"
#include "repose/surface/surface.h"

/// Fans: the triangles at a vertex that hang together over edges of two triangles. A manifold
/// surface has one at each vertex.
namespace repose::surface {

/// Corners (3 · triangle + k) united to fans.
UnionFind fans(const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Gives every fan a point of its own: where sheets touch in a point, copies of it come last.
void split_fans(Surface& surface);

}  // namespace repose::surface
