#include "repose/surface/write.h"

#include <bit>
#include <climits>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"
#include "soup.h"

namespace repose::surface {
namespace {

static_assert(std::endian::native == std::endian::little);

/// A number's bytes at the end of others, little endian.
template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

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
  for (const Triangle& triangle : surface.triangles) {
    const Corners at = corners(surface, triangle);
    for (const Vec3& vector : {Vec3(scaled_normal(at).normalized()), at[0], at[1], at[2]})
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

std::string base64(const std::string& bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t left = std::min<size_t>(3, bytes.size() - i);
    uint32_t three = 0;
    for (size_t b = 0; b < 3; ++b)
      three = three << 8 | (b < left ? static_cast<unsigned char>(bytes[i + b]) : 0u);
    for (size_t d = 0; d < 4; ++d) text += d <= left ? digits[three >> (18 - 6 * d) & 63] : '=';
  }
  return text;
}

/// One DataArray; rows of several numbers lie without gaps between them.
template <class Row>
std::string array(const char* type, const std::string& name, int components,
                  const std::vector<Row>& rows) {
  std::string bytes;
  append(bytes, static_cast<uint64_t>(rows.size() * sizeof(Row)));
  if (!rows.empty())
    bytes.append(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(Row));
  return fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"binary\">\n{}\n"
      "</DataArray>\n",
      type, name, components, base64(bytes));
}

std::string point_data(const PointData& data) {
  std::string text = data.fields.empty()
                         ? "<PointData>\n"
                         : fmt::format("<PointData Scalars=\"{}\">\n", data.fields[0].name);
  for (const auto& field : data.fields) text += array("Float64", field.name, 1, field.values);
  for (const auto& field : data.vectors) text += array("Float64", field.name, 3, field.values);
  if (!data.colors.empty()) text += array("UInt8", "color", 3, data.colors);
  return text + "</PointData>\n";
}

/// A surface as VTK XML PolyData: arrays as base64 with 64-bit lengths, not compressed.
std::string vtp_bytes(const Surface& surface, const PointData& data) {
  std::vector<int64_t> ends(surface.triangles.size());
  for (size_t t = 0; t < ends.size(); ++t) ends[t] = static_cast<int64_t>(3 * (t + 1));
  return fmt::format(
             "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n"
             "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
             "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
             surface.points.size(), surface.triangles.size()) +
         point_data(data) + "<Points>\n" + array("Float64", "Points", 3, surface.points) +
         "</Points>\n<Polys>\n" + array("Int64", "connectivity", 1, surface.triangles) +
         array("Int64", "offsets", 1, ends) + "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";
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
