#include <algorithm>

#include "repose/base/error.h"
#include "repose/surface/ply.h"
#include "repose/surface/read.h"
#include "soup.h"

namespace repose::surface {

namespace {

/// Returns 0, 1 or 2 for x, y and z, −1 for other properties.
int axis_of(const PlyProperty& property) {
  const std::string& name = property.name;
  return name == "x" ? 0 : name == "y" ? 1 : name == "z" ? 2 : -1;
}

VertexValues read_vertices(const PlyElement& element, PlyValues& body) {
  const std::vector<PlyProperty>& properties = element.properties;
  VertexValues result;
  for (const PlyProperty& property : properties)
    if (axis_of(property) < 0) result.names.push_back(property.name);
  result.values.resize(result.names.size());
  body.read(element, [&](uint64_t, const PlyValues::Row& values) {
    result.points.push_back(Vec3::Zero());
    size_t next = 0;
    for (size_t p = 0; p < properties.size(); ++p) {
      const double value = values[p].empty() ? 0 : values[p][0];
      const int axis = axis_of(properties[p]);
      if (axis < 0)
        result.values[next++].push_back(value);
      else
        result.points.back()[axis] = value;
    }
  });
  return result;
}

/// Rows of x, y and z among a vertex's properties; those of a checked header.
std::array<size_t, 3> coordinates(const PlyElement& vertex) {
  std::array<size_t, 3> rows{};
  for (size_t p = vertex.properties.size(); p-- > 0;)
    if (const int axis = axis_of(vertex.properties[p]); axis >= 0) rows[axis] = p;
  return rows;
}

}  // namespace

Soup parse_ply(const Content& content) {
  const PlyHeader header = parse_ply_header(content);
  check_ply(header, content);
  Soup soup;
  PlyValues body(content, header);
  for (const PlyElement& element : header.elements) {
    const bool vertex = element.is_vertex(), face = element.is_face();
    const std::array<size_t, 3> xyz = vertex ? coordinates(element) : std::array<size_t, 3>{};
    const size_t list = index_list(element);
    body.read(element, [&](uint64_t, const PlyValues::Row& row) {
      if (vertex) soup.points.push_back({row[xyz[0]][0], row[xyz[1]][0], row[xyz[2]][0]});
      if (face) soup.polygons.emplace_back(row[list].begin(), row[list].end());
    });
  }
  return soup;
}

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
    if (element.is_vertex()) return read_vertices(element, body);
    body.read(element, [](uint64_t, const PlyValues::Row&) {});
  }
  throw base::InternalError("check_ply let a file without vertices pass");
}

}  // namespace repose::surface
