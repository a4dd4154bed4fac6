#pragma once
#include <mpi.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "repose/model/model.h"
#include "repose/model/step.h"

namespace repose::results {

/// Where a run left off.
struct Restart {
  double load = 0;
  std::vector<Vec3> position;    ///< [this rank's slab of N] mm
  std::vector<double> pressure;  ///< [the same slab] N/mm², of contact there; 0 where unknown
  bool guess = false;            ///< the position is one of a search at load 1 that was not done
  int64_t kept = 0;  ///< steps of the file before this one, where its model is the same throughout
  /// On rank 0: the first array of the file's model that differs from the input's; empty: none.
  std::string differing;
  std::optional<model::StepNumbers> end;  ///< on rank 0: of the last step, if it is a rest position
                                          ///< at load 1 of a result of that same model
};

/// The last converged step of a result file; where that is not past load 0, or there is none, the
/// last step as a guess, if it is at load 1, else the start. Refuses (InputError) a file whose
/// model has other points than `model` (read on rank 0 only), or that holds no step.
/// Collective.
Restart read_restart(MPI_Comm comm, const std::filesystem::path& file, const model::Model& model);

}  // namespace repose::results
