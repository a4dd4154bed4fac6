#include <bit>

#include "repose/base/error.h"
#include "repose/base/whole_file.h"
#include "repose/surface/read.h"

namespace repose::surface {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string ply_bytes(const Surface& surface) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment mm\n"
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      surface.points.size(), surface.triangles.size());
  bytes.reserve(bytes.size() + 24 * surface.points.size() + 13 * surface.triangles.size());
  for (const auto& point : surface.points)
    for (int axis = 0; axis < 3; ++axis) append(bytes, point[axis]);
  for (const auto& triangle : surface.triangles) {
    append(bytes, uint8_t{3});
    for (const int64_t vertex : triangle) append(bytes, static_cast<int32_t>(vertex));
  }
  return bytes;
}

}  // namespace

void write_ply(const std::filesystem::path& file, const Surface& surface) {
  if (surface.points.size() > INT32_MAX)
    base::refuse("{}: {} vertices are more than a PLY file can number (2147483647)", file.string(),
                 surface.points.size());
  base::write_whole_file(file, ply_bytes(surface));
}

}  // namespace repose::surface
