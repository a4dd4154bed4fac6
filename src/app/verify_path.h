#pragma once
#include <mpi.h>

#include <vector>

#include "report.h"

namespace repose::app {

/// Solves `part` again from its initial state, in twice the load steps of `first`, which came to
/// rest, and compares `position`, this rank's slab, where that was. Collective.
PathCheck verify_path(MPI_Comm comm, const discrete::Part& part, solve::Settings settings,
                      const solve::Summary& first, const std::vector<Vec3>& position);

}  // namespace repose::app
