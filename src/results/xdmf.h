#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace repose::results {

/// One array of numbers at the points or the cells of a block.
struct XdmfArray {
  std::string name;
  std::string path;        ///< in the HDF5 file; "step/…" stands for /step/NNNN/…
  bool at_points = false;  ///< else one a cell
  bool vector = false;     ///< [.,3], else [.]
  const char* type = "NumberType=\"Float\" Precision=\"8\"";
  std::vector<bool> in_steps = {};  ///< [steps] which have it; empty: all
  std::string unit = {};            ///< without a slash; empty: none

  bool moves() const { return path.starts_with("step/"); }
  bool is_in(size_t step) const { return in_steps.empty() || in_steps[step]; }
  /// Its name in ParaView, with the unit.
  std::string title() const { return unit.empty() ? name : name + " (" + unit + ")"; }
  /// Its path in the file, at a step.
  std::string in_step(size_t step) const;
};

/// A kind of cell.
struct XdmfCell {
  const char* topology = "";  ///< attributes of the Topology element but the number of cells
  uint8_t vtk = 0;            ///< its number in VTK
  int corners = 0;
};

/// A mesh of one kind of cell that moves from step to step.
struct XdmfBlock {
  std::string name;  ///< last part of the file's name: tissue, springs, skin, bones
  XdmfCell cell;
  std::string connectivity;  ///< path of the i64 [cells, corners] dataset
  int64_t points = 0, cells = 0;
  std::vector<std::string> geometry;  ///< [steps] path of the f64 [points, 3] dataset
  std::vector<XdmfArray> arrays;
  int64_t first = 0, merged = 0;  ///< its rows in datasets of `merged` rows at points; 0: all
};

/// The XDMF document of a block: a temporal collection of Uniform grids, one for each load (its
/// time). `h5` is the name of the HDF5 file in the same folder.
std::string xdmf_document(const XdmfBlock& block, const std::string& h5,
                          const std::vector<double>& loads);

/// The XDMF document of several blocks by name: a spatial collection of temporal ones. VTK numbers
/// the second and later grids of a name, but names a block by its collection.
std::string xdmf_document(const std::vector<XdmfBlock>& blocks, const std::string& h5,
                          const std::vector<double>& loads);

}  // namespace repose::results
