#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/surface/surface.h"

namespace repose::surface {

/// Purpose of a surface, which decides what it must satisfy.
enum class Role {
  skin,  ///< may be open: a manifold patch or a closed surface, one component
  bone,  ///< closed, manifold, oriented outwards; several components are allowed
  mesh,  ///< manifold once sheets that touch in points are parted; of any size and parts
  raw    ///< any triangles of a head's size, which stay as they are
};

/// Reads PLY, STL, OBJ or OFF (binary or text, by content and ending) and returns its triangles as
/// stored: polygons are triangulated, nothing is welded (but STL stores no vertices: its equal
/// corners come as one). Throws InputError naming the file when it is missing, unreadable,
/// truncated, empty, has no faces, or holds a coordinate that is not finite or an index out of
/// range. Never allocates more memory than a small multiple of the file's size.
Surface read_surface(const std::filesystem::path& file);

/// Gives triangles the first of the vertices that coincide with theirs (coincident_points), and
/// drops those that then name a vertex twice. All points are kept.
Surface welded(const Surface& raw);

/// Welds coincident vertices (distance ≤ 1e-9 of the bounding diagonal: STL, or duplicates),
/// drops isolated vertices and degenerate or duplicate triangles (a flat triangle inside the mesh
/// is flipped away, so that no slit opens), and orients the result consistently: outwards where it
/// is closed (the wall of a cavity faces the cavity); an open patch keeps the majority orientation.
Surface weld_and_orient(const Surface& raw);

/// Writes a binary little-endian PLY (double coordinates) to NAME.part and renames it.
void write_ply(const std::filesystem::path& file, const Surface& surface);

/// Reads a surface, welds and orients it (weld_and_orient), and refuses defects (defects.h) that
/// `role` does not allow, in one line naming file, defect, number and remedy. Self-intersections
/// are not searched for: a caller that needs to know them inspects. A surface smaller than 2 mm or
/// larger than 2000 mm across, unless a mesh, is refused as being in meters or in micrometers.
Surface load_surface(const std::filesystem::path& file, Role role);

/// Checks a surface that has been read, or taken from a volume, as load_surface does.
Surface accept_surface(const Surface& raw, Role role);

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
