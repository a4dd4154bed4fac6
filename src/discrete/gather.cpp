#include "repose/discrete/gather.h"

#include "message.h"
#include "repose/base/agreement.h"

namespace repose::discrete {

std::vector<double> gather(MPI_Comm comm, const double* values, size_t count) {
  return gather_arrays(comm, std::vector<double>(values, values + count));
}

std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab) {
  return gather_arrays(comm, slab);
}

std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab,
                                std::vector<int64_t> rows) {
  auto count = static_cast<int64_t>(rows.size()), mine = static_cast<int64_t>(slab.size());
  MPI_Bcast(&count, 1, MPI_INT64_T, 0, comm);
  rows.resize(count);
  MPI_Bcast(rows.data(), static_cast<int>(count), MPI_INT64_T, 0, comm);
  int64_t begin = 0;
  MPI_Exscan(&mine, &begin, 1, MPI_INT64_T, MPI_SUM, comm);
  if (base::rank(comm) == 0) begin = 0;
  std::vector<Vec3> picked;
  for (const int64_t row : rows)
    if (row >= begin && row < begin + mine) picked.push_back(slab[row - begin]);
  return gather_arrays(comm, picked);
}

}  // namespace repose::discrete
