#include "xdmf.h"

#include <fmt/format.h>

#include <array>
#include <boost/algorithm/string/replace.hpp>
#include <utility>

namespace repose::results {

namespace {

constexpr const char* integer = "NumberType=\"Int\" Precision=\"8\"";
constexpr const char* real = "NumberType=\"Float\" Precision=\"8\"";

std::string escaped(std::string text) {
  for (const auto& [plain, entity] : {std::pair("&", "&amp;"), std::pair("<", "&lt;"),
                                      std::pair(">", "&gt;"), std::pair("\"", "&quot;")})
    boost::replace_all(text, plain, entity);
  return text;
}

std::string data_item(const std::string& h5, const std::string& path, int64_t rows, int columns,
                      const char* type) {
  const std::string dimensions =
      columns > 1 ? fmt::format("{} {}", rows, columns) : fmt::format("{}", rows);
  return fmt::format("<DataItem Format=\"HDF\" {} Dimensions=\"{}\">{}:{}</DataItem>", type,
                     dimensions, escaped(h5), path);
}

/// Rows of a dataset of `all`; 0: all there are.
std::string rows_item(const std::string& h5, const std::string& path,
                      const std::array<int64_t, 3>& of, int columns, const char* type) {
  const auto [first, rows, all] = of;
  if (all == 0) return data_item(h5, path, rows, columns, type);
  const bool flat = columns == 1;
  const std::string slab = flat ? fmt::format("{} 1 {}", first, rows)
                                : fmt::format("{} 0 1 1 {} {}", first, rows, columns);
  return fmt::format(
      "<DataItem ItemType=\"HyperSlab\" {} Dimensions=\"{}\"><DataItem Dimensions=\"3 {}\" "
      "Format=\"XML\">{}</DataItem>{}</DataItem>",
      type, flat ? fmt::format("{}", rows) : fmt::format("{} {}", rows, columns), flat ? 1 : 2,
      slab, data_item(h5, path, all, columns, type));
}

std::string point_item(const XdmfBlock& block, const std::string& h5, const std::string& path,
                       int columns, const char* type) {
  return rows_item(h5, path, {block.first, block.points, block.merged}, columns, type);
}

/// Beside points that are rows of a dataset, corners are given so, too: VTK compares the text of
/// both to see whether a mesh has moved, and reports an error where it has that of one only.
std::string corner_item(const XdmfBlock& block, const std::string& h5) {
  return rows_item(h5, block.connectivity, {0, block.cells, block.merged > 0 ? block.cells : 0},
                   block.cell.corners, integer);
}

std::string attribute(const XdmfBlock& block, const XdmfArray& array, const std::string& h5,
                      size_t step) {
  const int columns = array.vector ? 3 : 1;
  const std::string path = array.in_step(step);
  return fmt::format(
      "        <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n",
      array.title(), array.vector ? "Vector" : "Scalar", array.at_points ? "Node" : "Cell",
      array.at_points ? point_item(block, h5, path, columns, array.type)
                      : data_item(h5, path, block.cells, columns, array.type));
}

std::string grid(const XdmfBlock& block, const std::string& h5, size_t step, double load) {
  std::string text =
      fmt::format("      <Grid Name=\"{}\" GridType=\"Uniform\">\n", escaped(block.name));
  text += fmt::format("        <Time Value=\"{}\"/>\n", load);
  text += fmt::format("        <Topology {} NumberOfElements=\"{}\">{}</Topology>\n",
                      block.cell.topology, block.cells, corner_item(block, h5));
  text += fmt::format("        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                      point_item(block, h5, block.geometry[step], 3, real));
  for (const XdmfArray& array : block.arrays)
    if (array.is_in(step)) text += attribute(block, array, h5, step);
  return text + "      </Grid>\n";
}

/// A grid that holds others: `kind` is Temporal or Spatial.
std::string collection(const std::string& name, const char* kind, const std::string& grids) {
  return fmt::format(
      "    <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"{}\">\n{}    </Grid>\n",
      escaped(name), kind, grids);
}

std::string over_time(const XdmfBlock& block, const std::string& h5,
                      const std::vector<double>& loads) {
  std::string text;
  for (size_t step = 0; step < loads.size(); ++step) text += grid(block, h5, step, loads[step]);
  return collection(block.name, "Temporal", text);
}

std::string document(const std::string& content) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n{}  </Domain>\n</Xdmf>\n",
      content);
}

}  // namespace

std::string XdmfArray::in_step(size_t step) const {
  return moves() ? fmt::format("/step/{:04}/{}", step, path.substr(5)) : path;
}

std::string xdmf_document(const XdmfBlock& block, const std::string& h5,
                          const std::vector<double>& loads) {
  return document(over_time(block, h5, loads));
}

std::string xdmf_document(const std::vector<XdmfBlock>& blocks, const std::string& h5,
                          const std::vector<double>& loads) {
  std::string text;
  for (const XdmfBlock& block : blocks) text += over_time(block, h5, loads);
  return document(collection("blocks", "Spatial", text));
}

}  // namespace repose::results
