#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

/// Sampled volumes (CT, label maps) as plain arrays, nothing of the library that reads them.
namespace repose::imaging {

/// Told the share of a step's work that is done, in [0, 1]; may be empty.
using Watch = std::function<void(double)>;

/// Value of the voxels that count as those beyond the border, see leave_out().
constexpr float beyond_volume = -std::numeric_limits<float>::infinity();

/// Numbers at the points of a regular, perhaps oblique or sheared grid: voxel (i, j, k) has its
/// center at origin + axes · (i, j, k).
struct Volume {
  std::string name;                  ///< for messages: a file's or folder's path
  std::array<int64_t, 3> size{};     ///< voxels along i, j, k; each at least 2
  Mat3 axes = Mat3::Identity();      ///< mm, LPS; column a is one step along axis a
  Vec3 origin = Vec3::Zero();        ///< mm, LPS; center of voxel (0, 0, 0)
  std::vector<float> values;         ///< [k][j][i], HU or labels; finite, or beyond_volume
  std::vector<std::string> remarks;  ///< what was done to the data on reading, a line each

  int64_t index(int64_t i, int64_t j, int64_t k) const { return (k * size[1] + j) * size[0] + i; }
  float at(int64_t i, int64_t j, int64_t k) const { return values[index(i, j, k)]; }
  /// (i, j, k) of a voxel, given as its row of `values` like those below.
  std::array<int64_t, 3> index_of(int64_t voxel) const {
    return {voxel % size[0], voxel / size[0] % size[1], voxel / size[0] / size[1]};
  }
  Vec3 center(int64_t voxel) const {  ///< mm, LPS
    const auto [i, j, k] = index_of(voxel);
    return origin +
           axes * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
  }
  /// Calls visit(voxel) for the voxels that share a face with one.
  template <class Visit>
  void visit_neighbors(int64_t voxel, Visit&& visit) const {
    int64_t stride = 1;
    for (int axis = 0; axis < 3; stride *= size[axis++]) {
      const int64_t along = voxel / stride % size[axis];
      if (along > 0) visit(voxel - stride);
      if (along + 1 < size[axis]) visit(voxel + stride);
    }
  }
  double spacing(int axis) const { return axes.col(axis).norm(); }  ///< mm
};

/// The matrix from mm beside the origin to voxels.
Mat3 inverse_axes(const Volume& volume);

/// Reads a folder of DICOM slices, NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr) or MetaImage (.mha,
/// .mhd). Positions come in LPS: NIfTI, which is RAS, and NRRD in RAS are converted;
/// DICOM's rescale slope is applied; oblique axes and tilted gantries are kept as they are. Numbers
/// that are not finite become the least finite one, with a remark. Throws InputError, one line
/// naming the file, for what is missing, truncated, not three-dimensional, colored or without
/// spacing, and for a folder with several series, missing or doubled slices. `watch` follows DICOM
/// slices.
Volume read_volume(const std::filesystem::path& path, const Watch& watch = {});

}  // namespace repose::imaging
