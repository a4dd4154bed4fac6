#pragma once
#include <mpi.h>

#include <vector>

namespace repose::solve {

/// All ranks' values one after the other, on rank 0; empty on the others. Collective.
std::vector<double> gather(MPI_Comm comm, const double* values, size_t count);

}  // namespace repose::solve
