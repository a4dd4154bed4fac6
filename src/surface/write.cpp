#include "repose/surface/write.h"

#include <Eigen/Geometry>
#include <climits>

#include "bytes.h"
#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "repose/surface/read.h"
#include "soup.h"
#include "vtp.h"

namespace repose::surface {
namespace {

std::string ply_header(const Surface& surface, const PointData& data) {
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment mm\n"
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
      surface.points.size());
  if (!data.colors.empty())
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  for (const auto& field : data.fields) header += fmt::format("property double {}\n", field.name);
  return header +
         fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                     surface.triangles.size());
}

std::string ply_bytes(const Surface& surface, const PointData& data) {
  std::string bytes = ply_header(surface, data);
  const size_t row = 24 + (data.colors.empty() ? 0 : 3) + 8 * data.fields.size();
  bytes.reserve(bytes.size() + row * surface.points.size() + 13 * surface.triangles.size());
  for (size_t p = 0; p < surface.points.size(); ++p) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, surface.points[p][axis]);
    if (!data.colors.empty())
      for (const uint8_t part : data.colors[p]) append(bytes, part);
    for (const auto& field : data.fields) append(bytes, field.values[p]);
  }
  for (const auto& triangle : surface.triangles) {
    append(bytes, uint8_t{3});
    for (const int64_t vertex : triangle) append(bytes, static_cast<int32_t>(vertex));
  }
  return bytes;
}

std::string stl_bytes(const Surface& surface) {
  std::string bytes = "binary STL, mm";
  bytes.resize(80, ' ');
  append(bytes, static_cast<uint32_t>(surface.triangles.size()));
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3 &p = surface.points[a], &q = surface.points[b], &r = surface.points[c];
    const Vec3 normal = (q - p).cross(r - p).normalized();
    for (const Vec3& vector : {normal, p, q, r})
      for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(vector[axis]));
    append(bytes, uint16_t{0});
  }
  return bytes;
}

std::string obj_bytes(const Surface& surface, const PointData& data) {
  std::string text = "# mm\n";
  for (size_t p = 0; p < surface.points.size(); ++p) {
    const Vec3& point = surface.points[p];
    text += fmt::format("v {} {} {}", point.x(), point.y(), point.z());
    if (!data.colors.empty())
      for (const uint8_t part : data.colors[p]) text += fmt::format(" {:.4f}", part / 255.0);
    text += '\n';
  }
  for (const auto& [a, b, c] : surface.triangles)
    text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

std::string ending_of(const std::filesystem::path& file) {
  return base::lower(file.extension().string());
}

void write_ply(const std::filesystem::path& file, const Surface& surface, const PointData& data) {
  if (surface.points.size() > INT32_MAX)
    base::refuse("{}: {} vertices are more than a PLY file can number (2147483647); write .vtp",
                 file.string(), surface.points.size());
  base::write_whole_file(file, ply_bytes(surface, data));
}

}  // namespace

void check_surface_ending(const std::filesystem::path& file) {
  const std::string ending = ending_of(file);
  for (const char* known : {".ply", ".stl", ".obj", ".vtp"})
    if (ending == known) return;
  base::refuse("{}: the ending names no format of meshes; write .ply, .stl, .obj or .vtp",
               file.string());
}

void write_surface(const std::filesystem::path& file, const Surface& surface,
                   const PointData& data) {
  check_surface_ending(file);
  const std::string ending = ending_of(file);
  if (ending == ".ply") return write_ply(file, surface, data);
  if (ending == ".stl" && surface.triangles.size() > UINT32_MAX)
    base::refuse("{}: {} triangles are more than an STL file can number; write .vtp", file.string(),
                 surface.triangles.size());
  base::write_whole_file(file, ending == ".stl"   ? stl_bytes(surface)
                               : ending == ".obj" ? obj_bytes(surface, data)
                                                  : vtp_bytes(surface, data));
}

void write_ply(const std::filesystem::path& file, const Surface& surface) {
  write_ply(file, surface, {});
}

}  // namespace repose::surface
