#pragma once
#include <mpi.h>

namespace repose::discrete {

/// Returns the largest of the ranks' values. Collective.
inline double max_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, comm);
  return value;
}

/// Returns the sum of the ranks' values. Collective.
inline double sum_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm);
  return value;
}

}  // namespace repose::discrete
