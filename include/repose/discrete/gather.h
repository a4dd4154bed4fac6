#pragma once
#include <mpi.h>

#include <vector>

#include "repose/base/geometry.h"

namespace repose::discrete {

/// All ranks' values one after the other, on rank 0; empty on the others. Collective.
std::vector<double> gather(MPI_Comm comm, const double* values, size_t count);
/// Gathers points in the same way.
std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab);
/// The given `rows` (ascending, rank 0's) of all ranks' slabs, on rank 0. Collective.
std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab,
                                std::vector<int64_t> rows);

}  // namespace repose::discrete
