#include "vtkhdf.h"

#include <algorithm>

#include "writer.h"

namespace repose::results {

namespace {

using Indices = std::vector<int64_t>;
using Blocks = std::vector<XdmfBlock>;

/// Where each step begins in an array with `rows` rows a step; the same place if it does not move.
Indices beginnings(size_t steps, int64_t rows) {
  Indices offsets(steps);
  for (size_t step = 0; step < steps; ++step) offsets[step] = static_cast<int64_t>(step) * rows;
  return offsets;
}

int64_t rows_of(const XdmfBlock& block, bool at_points) {
  return at_points ? block.points : block.cells;
}

int64_t rows_of(const Blocks& blocks, bool at_points) {
  int64_t rows = 0;
  for (const XdmfBlock& block : blocks) rows += rows_of(block, at_points);
  return rows;
}

void write_cells(hid_t root, const Blocks& blocks) {
  Indices points, cells, ids, offsets;
  std::vector<uint8_t> types;
  std::vector<VirtualPiece> connectivity;
  hsize_t corners = 0;
  for (const XdmfBlock& block : blocks) {
    points.push_back(block.points);
    cells.push_back(block.cells);
    ids.push_back(block.cells * block.cell.corners);
    const Indices in_block = beginnings(block.cells + 1, block.cell.corners);
    offsets.insert(offsets.end(), in_block.begin(), in_block.end());
    types.insert(types.end(), block.cells, block.cell.vtk);
    connectivity.push_back({block.connectivity, corners});
    corners += ids.back();
  }
  write_array(root, "NumberOfPoints", points);
  write_array(root, "NumberOfCells", cells);
  write_array(root, "NumberOfConnectivityIds", ids);
  write_array(root, "Offsets", offsets);
  write_array(root, "Types", types);
  write_virtual(root, "Connectivity", connectivity, {corners});
}

void write_points(hid_t root, const Blocks& blocks, size_t steps) {
  std::vector<VirtualPiece> pieces;
  hsize_t row = 0;
  for (size_t step = 0; step < steps; ++step)
    for (const XdmfBlock& block : blocks) {
      pieces.push_back({block.geometry[step], row});
      row += block.points;
    }
  write_virtual(root, "Points", pieces, {row, 3});
}

/// The pieces of the arrays of one name, at points or at cells: of every step, if they move.
std::vector<VirtualPiece> pieces_of(const Blocks& blocks, const XdmfArray& like, size_t steps) {
  std::vector<VirtualPiece> pieces;
  hsize_t row = 0;
  for (size_t step = 0; step < steps; ++step)
    for (const XdmfBlock& block : blocks) {
      for (const XdmfArray& array : block.arrays)
        if (array.name == like.name && array.at_points == like.at_points && array.is_in(step))
          pieces.push_back({array.in_step(step), row});
      row += rows_of(block, like.at_points);
    }
  return pieces;
}

/// An array of all parts, and where each of its steps begins.
void write_array_of(hid_t data, hid_t begin, const Blocks& blocks, const XdmfArray& array,
                    size_t steps) {
  const int64_t rows = rows_of(blocks, array.at_points);
  write_array(begin, array.title(), beginnings(steps, array.moves() ? rows : 0));
  const size_t stored = array.moves() ? steps : 1;
  std::vector<hsize_t> shape = {stored * rows};
  if (array.vector) shape.push_back(3);
  write_virtual(data, array.title(), pieces_of(blocks, array, stored), shape);
}

void write_arrays(hid_t root, hid_t steps, const Blocks& blocks, bool at_points, size_t count) {
  const std::string place = at_points ? "PointData" : "CellData";
  const base::Hdf5Group data = base::create_hdf5_group(root, place.c_str());
  const base::Hdf5Group begin = base::create_hdf5_group(steps, (place + "Offsets").c_str());
  std::vector<std::string> written;
  for (const XdmfBlock& block : blocks)
    for (const XdmfArray& array : block.arrays) {
      const bool known = std::find(written.begin(), written.end(), array.name) != written.end();
      if (array.at_points != at_points || known) continue;
      write_array_of(data, begin, blocks, array, count);
      written.push_back(array.name);
    }
}

}  // namespace

void write_vtkhdf(hid_t file, const Blocks& blocks, const std::vector<double>& loads) {
  const size_t count = loads.size();
  const base::Hdf5Group root = base::create_hdf5_group(file, "VTKHDF");
  write_attribute(root, "Version", Indices{2, 0});
  write_attribute(root, "Type", std::string("UnstructuredGrid"));
  write_cells(root, blocks);
  write_points(root, blocks, count);
  const base::Hdf5Group steps = base::create_hdf5_group(root, "Steps");
  write_attribute(steps, "NSteps", static_cast<int64_t>(count));
  write_array(steps, "Values", loads);
  write_array(steps, "PartOffsets", beginnings(count, 0));
  write_array(steps, "NumberOfParts", Indices(count, std::ssize(blocks)));
  write_array(steps, "PointOffsets", beginnings(count, rows_of(blocks, true)));
  const Indices same = beginnings(count, 0);
  write_array(steps, "CellOffsets", {count, 1}, same.data());
  write_array(steps, "ConnectivityIdOffsets", {count, 1}, same.data());
  for (const bool at_points : {true, false}) write_arrays(root, steps, blocks, at_points, count);
}

int64_t vtkhdf_bytes(const Blocks& blocks, size_t steps) {
  int64_t bytes = int64_t{1} << 16;
  for (const XdmfBlock& block : blocks) {
    const size_t a_step = (block.arrays.size() + 2) * 256;  // a mapping names its dataset
    bytes += 9 * block.cells + static_cast<int64_t>(steps * a_step);
  }
  return bytes;
}

}  // namespace repose::results
