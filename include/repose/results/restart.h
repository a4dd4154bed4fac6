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
};

/// The last converged step of a result file. Refuses (InputError) a file whose model has other
/// points than `model` (looked at on rank 0 only), or that holds no converged step. Collective.
Restart read_restart(MPI_Comm comm, const std::filesystem::path& file, const model::Model& model);

}  // namespace repose::results
