#pragma once
#include <mpi.h>

#include <vector>

#include "repose/base/geometry.h"

namespace repose::base {

/// Rows that rank 0 holds, as a slab (base::slab) on every rank. Collective.
std::vector<Vec3> scatter(MPI_Comm comm, const std::vector<Vec3>& all);

}  // namespace repose::base
