#include "vtp.h"

#include <fmt/format.h>

#include "bytes.h"

namespace repose::surface {
namespace {

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

/// One DataArray; `values` are its raw bytes.
std::string array(const char* type, const std::string& name, int components,
                  const std::string& values) {
  std::string bytes;
  append(bytes, static_cast<uint64_t>(values.size()));
  return fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"binary\">\n{}\n"
      "</DataArray>\n",
      type, name, components, base64(bytes + values));
}

std::string point_data(const PointData& data) {
  std::string text = data.fields.empty()
                         ? "<PointData>\n"
                         : fmt::format("<PointData Scalars=\"{}\">\n", data.fields[0].name);
  for (const auto& field : data.fields) {
    std::string bytes;
    for (const double value : field.values) append(bytes, value);
    text += array("Float64", field.name, 1, bytes);
  }
  for (const auto& field : data.vectors) {
    std::string bytes;
    for (const Vec3& value : field.values)
      for (int axis = 0; axis < 3; ++axis) append(bytes, value[axis]);
    text += array("Float64", field.name, 3, bytes);
  }
  if (!data.colors.empty()) {
    std::string bytes;
    for (const auto& color : data.colors)
      for (const uint8_t part : color) append(bytes, part);
    text += array("UInt8", "color", 3, bytes);
  }
  return text + "</PointData>\n";
}

}  // namespace

std::string vtp_bytes(const Surface& surface, const PointData& data) {
  std::string points, corners, ends;
  for (const Vec3& point : surface.points)
    for (int axis = 0; axis < 3; ++axis) append(points, point[axis]);
  int64_t end = 0;
  for (const Triangle& triangle : surface.triangles) {
    for (const int64_t vertex : triangle) append(corners, vertex);
    append(ends, end += 3);
  }
  return fmt::format(
             "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n"
             "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
             "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
             surface.points.size(), surface.triangles.size()) +
         point_data(data) + "<Points>\n" + array("Float64", "Points", 3, points) +
         "</Points>\n<Polys>\n" + array("Int64", "connectivity", 1, corners) +
         array("Int64", "offsets", 1, ends) + "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";
}

}  // namespace repose::surface
