#pragma once
#include <mpi.h>

#include <vector>

#include "report.h"

namespace repose::app {

/// Solves `model` (on rank 0) again from its initial state, in twice the load steps of `first`,
/// which came to rest, and compares `position` [N] on rank 0, where that was. Collective.
PathCheck verify_path(MPI_Comm comm, const model::Model& model, solve::Settings settings,
                      const solve::Summary& first, const std::vector<Vec3>& position);

}  // namespace repose::app
