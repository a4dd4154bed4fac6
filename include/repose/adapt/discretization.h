#pragma once
#include <string>
#include <vector>

#include "repose/adapt/grid_sequence.h"

/// Estimate of the discretization error: the distance of a model's skin from that of the continuum.
namespace repose::adapt {

/// Resolutions to compare a scene's own with, coarsest first: edges four times and twice as long, a
/// quarter and half of the gaps between layers where the scene lets them be any number. Those that
/// would leave fewer than 100 columns are left out. On rank 0.
std::vector<Resolution> halved_resolutions(const model::Anatomy& anatomy);

/// Resolutions towards the continuum, through a scene's own and beyond it, coarsest first: edges
/// and gaps halve from one to the next.
struct Convergence {
  std::vector<Resolution> resolutions;
  std::string limit;  ///< why there is none finer
};

/// Returns the resolutions of a convergence study: halved_resolutions(), the scene's own and, where
/// the scene sets tissue.edge and leaves the layers free, up to two finer ones of at most
/// `max_unknowns`. On rank 0.
Convergence convergence_of(const model::Anatomy& anatomy, const model::Counts& own,
                           int64_t max_unknowns = 5'000'000);

/// Estimated distances (mm) of the skin's rest position from that of an ever finer model.
struct Discretization {
  double order = 1;              ///< with which differences fall when all lengths are halved
  bool observed = false;         ///< in three resolutions; else the 1 that is assumed
  double mean = 0, largest = 0;  ///< over the skin points that move
  double percentile_95 = 0;
  std::vector<double> at_point;  ///< [N of the model] 0 below the skin
};

/// Estimates the discretization error of the rest position `position` [N] of the scene's own model
/// by Richardson's extrapolation (1911): where differences between resolutions fall with the order
/// p, |u_h − u_2h| / (2^p − 1) is left. p is observed where `sequence` has two resolutions, and is
/// kept within 1/2 and 2. On rank 0.
Discretization discretization_of(const std::vector<Vec3>& position, const GridSequence& sequence);

/// Returns a row of the end-of-run summary about the discretization error.
std::string describe_discretization(const Discretization& found);

}  // namespace repose::adapt
