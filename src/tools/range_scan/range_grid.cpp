#include <algorithm>
#include <cmath>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/surface/ply.h"
#include "repose/tools/range_scan/range_scan.h"

namespace repose::tools::range_scan {
using namespace surface;
namespace {

constexpr int64_t max_cells = int64_t{1} << 32;

/// The number behind "obj_info NAME".
int64_t info(const Content& content, const PlyHeader& header, const char* name) {
  const std::string_view text = std::string_view(content.bytes).substr(0, header.bytes);
  for (size_t position = 0; position < text.size();) {
    const auto line = base::words(base::next_line(text, position));
    if (line.size() != 3 || line[0] != "obj_info" || line[1] != name) continue;
    const auto number = base::parse_integer(line[2]);
    if (number && *number > 1 && *number < max_cells) return *number;
    base::refuse("{}: obj_info {} is {}; it must be a whole number > 1", content.file.string(),
                 name, base::quote(line[2]));
  }
  base::refuse("{}: not a range grid: its header has no obj_info {}; give the scanner's raw PLY",
               content.file.string(), name);
}

const PlyElement& element_of(const PlyHeader& header, const char* name, const std::string& file) {
  for (const PlyElement& element : header.elements)
    if (element.name == name) return element;
  base::refuse("{}: not a range grid: it has no element {}; give the scanner's raw PLY", file,
               name);
}

/// Where each property of a vertex goes.
struct Columns {
  std::array<int64_t, 3> position{-1, -1, -1}, color{-1, -1, -1};
  std::vector<size_t> other;
};

Columns columns_of(const PlyElement& vertex, const std::string& file) {
  Columns columns;
  const auto find = [](const std::string& name, std::array<const char*, 3> names) {
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  for (size_t p = 0; p < vertex.properties.size(); ++p) {
    const std::string& name = vertex.properties[p].name;
    const auto axis = find(name, {"x", "y", "z"}), part = find(name, {"red", "green", "blue"});
    if (axis < 3)
      columns.position[axis] = static_cast<int64_t>(p);
    else if (part < 3)
      columns.color[part] = static_cast<int64_t>(p);
    else if (!vertex.properties[p].list_size)
      columns.other.push_back(p);
  }
  if (*std::min_element(columns.position.begin(), columns.position.end()) < 0)
    base::refuse("{}: its vertices lack x, y or z; give the scanner's raw PLY", file);
  return columns;
}

void add_point(RangeGrid& grid, const Columns& columns, const PlyValues::Row& row) {
  const auto number = [&](int64_t property) {
    return row[property].empty() ? 0 : row[property][0];
  };
  Vec3 point;
  for (int axis = 0; axis < 3; ++axis) point[axis] = number(columns.position[axis]);
  if (!point.allFinite())
    base::refuse("{}: vertex {} has a coordinate that is not finite; scan again or remove it",
                 grid.name, grid.points.size());
  grid.points.push_back(point);
  if (columns.color[0] >= 0 && columns.color[1] >= 0 && columns.color[2] >= 0) {
    std::array<uint8_t, 3> color;
    for (int part = 0; part < 3; ++part)  // what is no number becomes 0
      color[part] = static_cast<uint8_t>(std::fmin(std::fmax(number(columns.color[part]), 0), 255));
    grid.data.colors.push_back(color);
  }
  for (size_t f = 0; f < columns.other.size(); ++f)
    grid.data.fields[f].values.push_back(number(static_cast<int64_t>(columns.other[f])));
}

int64_t cell_of(const PlyValues::Row& row, uint64_t number, const RangeGrid& grid) {
  if (row[0].empty()) return -1;
  const double point = row[0][0];
  if (point >= 0 && point < static_cast<double>(grid.points.size()) && point == std::floor(point))
    return static_cast<int64_t>(point);
  base::refuse("{}: cell {} of the range grid names point {:g}, but there are {}; export it again",
               grid.name, number, point, grid.points.size());
}

}  // namespace

RangeGrid read_range_grid(const std::filesystem::path& file) {
  const Content content = read_content(file);
  if (!content.bytes.starts_with("ply"))
    base::refuse("{}: not a PLY file; give the scanner's raw range-grid PLY", file.string());
  const PlyHeader header = parse_ply_header(content);
  RangeGrid grid;
  grid.name = file.string();
  grid.columns = info(content, header, "num_cols");
  grid.rows = info(content, header, "num_rows");
  const PlyElement& vertex = element_of(header, "vertex", grid.name);
  const PlyElement& cells = element_of(header, "range_grid", grid.name);
  if (cells.count != static_cast<uint64_t>(grid.columns * grid.rows))
    base::refuse("{}: {} cells, but {} columns × {} rows; the header is damaged", grid.name,
                 cells.count, grid.columns, grid.rows);
  const Columns columns = columns_of(vertex, grid.name);
  for (const size_t p : columns.other) grid.data.fields.push_back({vertex.properties[p].name, {}});
  PlyValues values(content, header);
  for (const PlyElement& element : header.elements)
    values.read(element, [&](uint64_t number, const PlyValues::Row& row) {
      if (&element == &vertex) add_point(grid, columns, row);
      if (&element == &cells) grid.cell.push_back(cell_of(row, number, grid));
    });
  return grid;
}

}  // namespace repose::tools::range_scan
