#pragma once
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

namespace repose::surface {

constexpr size_t stl_header_bytes = 84;    ///< 80 of text and the number of triangles
constexpr size_t stl_triangle_bytes = 50;  ///< twelve floats and a 16-bit attribute

/// The number of triangles that a binary STL promises; none for a file shorter than its header.
inline std::optional<uint32_t> stl_triangles(const std::string& bytes) {
  if (bytes.size() < stl_header_bytes) return std::nullopt;
  uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + 80, sizeof triangles);
  return triangles;
}

/// The size in bytes that a binary STL promises; 0 for a file shorter than its header.
inline size_t stl_size(const std::string& bytes) {
  const auto triangles = stl_triangles(bytes);
  return triangles ? stl_header_bytes + stl_triangle_bytes * size_t{*triangles} : 0;
}

}  // namespace repose::surface
