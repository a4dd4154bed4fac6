#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "repose/imaging/isosurface.h"
#include "repose/imaging/volume.h"

/// A surface out of a volume, with what is usually done before and after.
namespace repose::imaging {

using surface::Surface;

/// Options of a surface from a volume: one of level, otsu and label; the rest in the order it is
/// done.
struct Extraction {
  std::optional<double> level;             ///< HU, or whatever the volume holds
  bool otsu = false;                       ///< the level by Otsu's method
  std::optional<int64_t> label;            ///< of a label map
  std::optional<std::array<Vec3, 2>> box;  ///< mm, LPS: lowest and highest corner, see crop()
  std::optional<double> core;              ///< HU, see keep_core()
  double close_holes = 0;                  ///< mm, see close_gaps(); 0: none
  double voxel = 0;                        ///< mm, see coarsen(); 0: as it is
  VolumeBorder border = VolumeBorder::closed;
  bool largest = false;         ///< the largest component alone
  double components_above = 0;  ///< mm³; 0: all components
  int64_t smooth = 0;           ///< rounds, see smooth_taubin()
};

/// Standard deviation of the Gaussian that rounds the steps of a label's border, voxels.
constexpr double label_smoothing = 0.7;

constexpr double core_reach = 3;  ///< mm, see keep_core()

struct Extracted {
  Surface surface;
  double level;                      ///< the one used; 0 for a label
  std::vector<std::string> remarks;  ///< what was done to the data, a line each
};

/// Told the step under way and the share of it that is done.
using StepWatch = std::function<void(const std::string& step, double done)>;

/// Throws InputError as the functions it calls do, and where not exactly one of level, otsu and
/// label is requested.
Extracted extract(const Volume& volume, const Extraction& requested, const StepWatch& watch = {});

}  // namespace repose::imaging
