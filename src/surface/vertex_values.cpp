#include "repose/surface/read.h"

#include <algorithm>

#include "ply_values.h"
#include "repose/base/error.h"

namespace repose::surface {

namespace {

/// 0, 1 or 2 of x, y and z; −1 of anything else.
int axis_of(const PlyProperty& property) {
  const std::string& name = property.name;
  return name == "x" ? 0 : name == "y" ? 1 : name == "z" ? 2 : -1;
}

VertexValues read_vertices(const PlyElement& element, PlyValues& body) {
  const std::vector<PlyProperty>& properties = element.properties;
  VertexValues result;
  result.points.assign(element.count, Vec3::Zero());
  for (const PlyProperty& property : properties)
    if (axis_of(property) < 0) result.names.push_back(property.name);
  result.values.assign(result.names.size(), std::vector<double>(element.count));
  body.read(element, [&](uint64_t row, const PlyValues::Row& values) {
    size_t next = 0;
    for (size_t p = 0; p < properties.size(); ++p) {
      const double value = values[p].empty() ? 0 : values[p][0];
      const int axis = axis_of(properties[p]);
      (axis < 0 ? result.values[next++][row] : result.points[row][axis]) = value;
    }
  });
  return result;
}

}  // namespace

const std::vector<double>* VertexValues::find(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? nullptr : &values[found - names.begin()];
}

VertexValues read_vertex_values(const std::filesystem::path& file) {
  const Content content = read_content(file);
  if (!content.bytes.starts_with("ply"))
    base::refuse(
        "{}: is not a PLY file, the only one read with colors and values; export the painted mesh "
        "as PLY",
        file.string());
  const PlyHeader header = parse_ply_header(content);
  check_ply(header, content);
  PlyValues body(content, header);
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex" || element.name == "vertices") return read_vertices(element, body);
    body.read(element, [](uint64_t, const PlyValues::Row&) {});
  }
  throw base::InternalError("check_ply let a file without vertices pass");
}

}  // namespace repose::surface
