#include "repose/results/vtkhdf.h"

#include "repose/results/writer.h"

namespace repose::results {

namespace {

using Numbers = std::vector<int64_t>;

void write_numbers(hid_t place, const char* name, const Numbers& values) {
  write_array(place, name, {values.size()}, values.data());
}

/// Where each step begins in an array with `rows` rows a step; the same place if it does not move.
Numbers beginnings(size_t steps, int64_t rows) {
  Numbers offsets(steps);
  for (size_t step = 0; step < steps; ++step) offsets[step] = static_cast<int64_t>(step) * rows;
  return offsets;
}

void write_cells(hid_t file, hid_t root, const XdmfBlock& block) {
  write_numbers(root, "NumberOfPoints", {block.points});
  write_numbers(root, "NumberOfCells", {block.cells});
  write_numbers(root, "NumberOfConnectivityIds", {block.cells * block.corners});
  write_numbers(root, "Offsets", beginnings(block.cells + 1, block.corners));
  const std::vector<uint8_t> types(block.cells, block.vtk_cell);
  write_array(root, "Types", {types.size()}, types.data());
  write_virtual(file, root, "Connectivity", {block.connectivity},
                {static_cast<hsize_t>(block.cells * block.corners)});
}

/// Arrays at the points or at the cells, and where each of their steps begins.
void write_arrays(hid_t file, hid_t root, hid_t steps, const XdmfBlock& block, bool at_points,
                  size_t count) {
  const std::string place = at_points ? "PointData" : "CellData";
  const base::Hdf5Group data = base::create_hdf5_group(root, place.c_str());
  const base::Hdf5Group begin = base::create_hdf5_group(steps, (place + "Offsets").c_str());
  const int64_t rows = at_points ? block.points : block.cells;
  for (const XdmfArray& array : block.arrays) {
    if (array.at_points != at_points) continue;
    const bool moves = array.moves();
    write_numbers(begin, array.name.c_str(), beginnings(count, moves ? rows : 0));
    if (!moves) {
      link_to(file, array.path, data, array.name);
      continue;
    }
    std::vector<std::string> paths;
    for (size_t step = 0; step < count; ++step) paths.push_back(array.in_step(step));
    std::vector<hsize_t> shape = {count * rows};
    if (array.vector) shape.push_back(3);
    write_virtual(file, data, array.name, paths, shape);
  }
}

}  // namespace

void write_vtkhdf(hid_t file, const XdmfBlock& block, const std::vector<double>& loads) {
  const size_t count = loads.size();
  const base::Hdf5Group root = base::create_hdf5_group(file, "VTKHDF");
  write_attribute(root, "Version", Numbers{2, 0});
  write_attribute(root, "Type", std::string("UnstructuredGrid"));
  write_cells(file, root, block);
  write_virtual(file, root, "Points", block.geometry,
                {count * static_cast<hsize_t>(block.points), 3});
  const base::Hdf5Group steps = base::create_hdf5_group(root, "Steps");
  write_attribute(steps, "NSteps", static_cast<int64_t>(count));
  write_array(steps, "Values", {count}, loads.data());
  write_numbers(steps, "PartOffsets", beginnings(count, 0));
  write_numbers(steps, "NumberOfParts", Numbers(count, 1));
  write_numbers(steps, "PointOffsets", beginnings(count, block.points));
  const Numbers same = beginnings(count, 0);
  write_array(steps, "CellOffsets", {count, 1}, same.data());
  write_array(steps, "ConnectivityIdOffsets", {count, 1}, same.data());
  for (const bool at_points : {true, false})
    write_arrays(file, root, steps, block, at_points, count);
}

int64_t vtkhdf_bytes(const XdmfBlock& block, size_t steps) {
  const size_t a_step = (block.arrays.size() + 2) * 256;  // a mapping names its dataset
  return 9 * block.cells + static_cast<int64_t>(steps * a_step) + (int64_t{1} << 16);
}

}  // namespace repose::results
