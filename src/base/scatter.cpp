#include "repose/base/scatter.h"

#include <algorithm>

#include "repose/base/agreement.h"

namespace repose::base {

// One message each, of whole points: bytes and coordinates may be too many for an int.
std::vector<Vec3> scatter(MPI_Comm comm, const std::vector<Vec3>& all) {
  const int ranks = size(comm), rank = base::rank(comm);
  int64_t total = static_cast<int64_t>(all.size());
  MPI_Bcast(&total, 1, MPI_INT64_T, 0, comm);
  const Slab mine = slab(total, rank, ranks);
  MPI_Datatype point;
  MPI_Type_contiguous(3, MPI_DOUBLE, &point);
  MPI_Type_commit(&point);
  std::vector<Vec3> rows(mine.rows());
  if (rank == 0) {
    std::copy_n(all.begin(), mine.rows(), rows.begin());
    for (int to = 1; to < ranks; ++to) {
      const Slab theirs = slab(total, to, ranks);
      MPI_Send(all.data() + theirs.begin, static_cast<int>(theirs.rows()), point, to, 0, comm);
    }
  } else {
    MPI_Recv(rows.data(), static_cast<int>(mine.rows()), point, 0, 0, comm, MPI_STATUS_IGNORE);
  }
  MPI_Type_free(&point);
  return rows;
}

}  // namespace repose::base
