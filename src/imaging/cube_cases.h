#pragma once
#include <array>
#include <cstdint>
#include <vector>

/// The triangles of one cube of marching cubes, derived, not listed.
///
/// Corner c of a cube lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4 a + b runs along axis a; b
/// holds the two other coordinates of its ends, the lower axis in bit 0.
namespace repose::imaging {

constexpr int cube_edges = 12;

/// The corners at the lower and the upper end of an edge.
std::array<int, 2> edge_corners(int edge);

/// Triangles as triples of edges, counter-clockwise seen from the corners that are not set.
using CubeTriangles = std::vector<std::array<uint8_t, 3>>;

/// For every set of corners inside (bit c: corner c) the triangles between inside and outside.
///
/// Each face of the cube is crossed by segments around every run of its inside corners, which
/// parts inside corners that face each other across the face; both cubes at a face see the same
/// segments. The segments close to loops, each of which is cut into triangles without any diagonal
/// that joins two edges of one face: an edge of the mesh on a face is then one of its segments, in
/// two triangles, and one inside a cube is a diagonal, in two triangles. Among the ways to cut the
/// one with the largest smallest angle is taken, with crossings at the middle of edges.
const std::array<CubeTriangles, 256>& cube_cases();

}  // namespace repose::imaging
