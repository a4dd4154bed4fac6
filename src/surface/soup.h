#pragma once
#include <cstdint>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/surface/ply.h"

/// Contents of a mesh file, between its bytes and a Surface.
namespace repose::surface {

/// Points and polygons as a file stores them; nothing checked.
struct Soup {
  std::vector<Vec3> points;
  std::vector<std::vector<int64_t>> polygons;  ///< 0-based rows of points
};

enum class Format { ply, stl_text, stl_binary, obj, off };

constexpr size_t stl_header_bytes = 84;    ///< 80 of text and the number of triangles
constexpr size_t stl_triangle_bytes = 50;  ///< twelve floats and a 16-bit attribute

/// The size in bytes that a binary STL promises; 0 for a file shorter than its header.
size_t stl_size(const std::string& bytes);

/// The format by content; the ending decides only where the content does not. Throws InputError
/// when it is none of the known ones.
Format recognize(const Content& content);

/// Readers of one format each; they refuse what is damaged, truncated or promises more than the
/// file can hold, in one line. Indices and coordinates are left to read_surface.
Soup parse_ply(const Content& content);
Soup parse_stl_text(Content content);
Soup parse_stl_binary(Content content);
Soup parse_obj(Content content);
Soup parse_off(Content content);

}  // namespace repose::surface
