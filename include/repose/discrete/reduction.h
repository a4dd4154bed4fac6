#pragma once
#include <mpi.h>

#include <cstddef>
#include <cstdint>

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

/// Returns the sum of the ranks' counts. Collective.
inline int64_t count_over_ranks(MPI_Comm comm, size_t count) {
  auto sum = static_cast<int64_t>(count);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_INT64_T, MPI_SUM, comm);
  return sum;
}

/// Returns the sum of the counts of the ranks before this one. Collective.
inline int64_t count_before(MPI_Comm comm, size_t count) {
  auto mine = static_cast<int64_t>(count), end = mine;
  MPI_Scan(&mine, &end, 1, MPI_INT64_T, MPI_SUM, comm);
  return end - mine;
}

}  // namespace repose::discrete
