#include "repose/discrete/gather.h"

#include "message.h"
#include "repose/base/agreement.h"
#include "repose/discrete/reduction.h"

namespace repose::discrete {

std::vector<double> gather(MPI_Comm comm, const double* values, size_t count) {
  return gather_arrays(comm, std::vector<double>(values, values + count));
}

std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab) {
  return gather_arrays(comm, slab);
}

std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab,
                                std::vector<int64_t> rows) {
  auto count = static_cast<int64_t>(rows.size());
  MPI_Bcast(&count, 1, MPI_INT64_T, 0, comm);
  rows.resize(count);
  MPI_Bcast(rows.data(), static_cast<int>(count), MPI_INT64_T, 0, comm);
  const int64_t begin = count_before(comm, slab.size()),
                end = begin + static_cast<int64_t>(slab.size());
  std::vector<Vec3> picked;
  for (const int64_t row : rows)
    if (row >= begin && row < end) picked.push_back(slab[row - begin]);
  return gather_arrays(comm, picked);
}

}  // namespace repose::discrete
