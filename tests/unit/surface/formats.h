#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <string>
#include <vector>

#include "shapes.h"

/// Mesh files written by hand, byte for byte as each format says.
namespace repose::surface {

template <class Value>
std::string bytes_of(Value value, bool big_endian = false) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

inline std::string ply_header(const Surface& s, const std::string& format) {
  return fmt::format(
      "ply\nformat {} 1.0\ncomment by hand\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      format, s.points.size(), s.triangles.size());
}

inline std::string ply_text(const Surface& s) {
  std::string text = ply_header(s, "ascii");
  for (const auto& p : s.points) text += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& t : s.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

inline std::string ply_binary(const Surface& s, bool big) {
  std::string bytes = ply_header(s, big ? "binary_big_endian" : "binary_little_endian");
  for (const auto& p : s.points)
    for (int k = 0; k < 3; ++k) bytes += bytes_of(static_cast<float>(p[k]), big);
  for (const auto& t : s.triangles) {
    bytes += '\3';
    for (const int64_t v : t) bytes += bytes_of(static_cast<int32_t>(v), big);
  }
  return bytes;
}

inline std::string stl_text(const Surface& s) {
  std::string text = "solid by hand\n";
  for (const auto& t : s.triangles) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const int64_t v : t) {
      const Vec3& p = s.points[v];
      text += fmt::format("   vertex {} {} {}\n", p.x(), p.y(), p.z());
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid by hand\n";
}

inline std::string stl_binary(const Surface& s, const std::string& title = "by hand") {
  std::string bytes = title + std::string(80 - title.size(), ' ');
  bytes += bytes_of(static_cast<uint32_t>(s.triangles.size()));
  for (const auto& t : s.triangles) {
    bytes += std::string(12, '\0');
    for (const int64_t v : t)
      for (int k = 0; k < 3; ++k) bytes += bytes_of(static_cast<float>(s.points[v][k]));
    bytes += std::string(2, '\0');
  }
  return bytes;
}

inline std::string obj_text(const Surface& s) {
  std::string text = "# by hand\no thing\n";
  for (const auto& p : s.points) text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  text += "vn 0 0 1\nusemtl skin\ns off\n";
  for (const auto& t : s.triangles)
    text += fmt::format("f {}//1 {}//1 {}//1\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

inline std::string off_text(const Surface& s) {
  std::string text =
      fmt::format("# by hand\nOFF\n{} {} 0\n\n", s.points.size(), s.triangles.size());
  for (const auto& p : s.points) text += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& t : s.triangles)
    text += fmt::format("3 {} {} {} 255 0 0 # red\n", t[0], t[1], t[2]);
  return text;
}

inline std::string off_binary(const Surface& s) {
  std::string bytes = "OFF BINARY\n";
  for (const size_t n : {s.points.size(), s.triangles.size(), size_t{0}})
    bytes += bytes_of(static_cast<int32_t>(n), true);
  for (const auto& p : s.points)
    for (int k = 0; k < 3; ++k) bytes += bytes_of(static_cast<float>(p[k]), true);
  for (const auto& t : s.triangles) {
    bytes += bytes_of(int32_t{3}, true);
    for (const int64_t v : t) bytes += bytes_of(static_cast<int32_t>(v), true);
    bytes += bytes_of(int32_t{0}, true);
  }
  return bytes;
}

struct Written {
  const char* what;
  std::string ending, bytes;
};

inline std::vector<Written> every_format(const Surface& s) {
  return {{"PLY text", ".ply", ply_text(s)},
          {"PLY little endian", ".ply", ply_binary(s, false)},
          {"PLY big endian", ".ply", ply_binary(s, true)},
          {"STL text", ".stl", stl_text(s)},
          {"STL binary", ".stl", stl_binary(s)},
          {"STL binary titled solid", ".stl", stl_binary(s, "solid block")},
          {"OBJ", ".obj", obj_text(s)},
          {"OFF text", ".off", off_text(s)},
          {"OFF binary", ".off", off_binary(s)}};
}

}  // namespace repose::surface
