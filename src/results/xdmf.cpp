#include "xdmf.h"

#include <fmt/format.h>

namespace repose::results {

namespace {

constexpr const char* integer = "NumberType=\"Int\" Precision=\"8\"";
constexpr const char* real = "NumberType=\"Float\" Precision=\"8\"";

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  return result;
}

std::string data_item(const std::string& h5, const std::string& path, int64_t rows, int columns,
                      const char* type) {
  const std::string dimensions =
      columns > 1 ? fmt::format("{} {}", rows, columns) : fmt::format("{}", rows);
  return fmt::format("<DataItem Format=\"HDF\" {} Dimensions=\"{}\">{}:{}</DataItem>", type,
                     dimensions, escaped(h5), path);
}

std::string attribute(const XdmfBlock& block, const XdmfArray& array, const std::string& h5,
                      size_t step) {
  const int64_t rows = array.at_points ? block.points : block.cells;
  return fmt::format(
      "        <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n",
      array.name, array.vector ? "Vector" : "Scalar", array.at_points ? "Node" : "Cell",
      data_item(h5, array.in_step(step), rows, array.vector ? 3 : 1, array.type));
}

std::string grid(const XdmfBlock& block, const std::string& h5, size_t step, double load) {
  std::string text = fmt::format("      <Grid Name=\"{}\" GridType=\"Uniform\">\n", block.name);
  text += fmt::format("        <Time Value=\"{}\"/>\n", load);
  text += fmt::format("        <Topology {} NumberOfElements=\"{}\">{}</Topology>\n",
                      block.topology, block.cells,
                      data_item(h5, block.connectivity, block.cells, block.corners, integer));
  text += fmt::format("        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                      data_item(h5, block.geometry[step], block.points, 3, real));
  for (const XdmfArray& array : block.arrays)
    if (array.is_in(step)) text += attribute(block, array, h5, step);
  return text + "      </Grid>\n";
}

}  // namespace

std::string XdmfArray::in_step(size_t step) const {
  return moves() ? fmt::format("/step/{:04}/{}", step, path.substr(5)) : path;
}

std::string xdmf_document(const XdmfBlock& block, const std::string& h5,
                          const std::vector<double>& loads) {
  std::string text = "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n";
  text += fmt::format(
      "    <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n", block.name);
  for (size_t step = 0; step < loads.size(); ++step) text += grid(block, h5, step, loads[step]);
  return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

}  // namespace repose::results
