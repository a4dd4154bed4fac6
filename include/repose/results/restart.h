#pragma once
#include <mpi.h>

#include <filesystem>
#include <vector>

#include "repose/model/model.h"

namespace repose::results {

/// Where a run left off.
struct Restart {
  double load = 0;
  std::vector<Vec3> position;  ///< [this rank's slab of N] mm
  bool guess = false;          ///< the position is one of a search at load 1 that was not done
};

/// The last converged step of a result file; where that is not past load 0, or there is none, the
/// last step as a guess, if it is at load 1. Refuses (InputError) a file whose model has other
/// points than `model` (looked at on rank 0 only), or that holds neither. Collective.
Restart read_restart(MPI_Comm comm, const std::filesystem::path& file, const model::Model& model);

}  // namespace repose::results
