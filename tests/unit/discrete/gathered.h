#pragma once
#include <vector>

#include "repose/base/agreement.h"
#include "repose/model/model.h"

namespace repose::testing {

/// All of an array of which each rank has its slab, on every rank.
inline std::vector<double> gather(const double* slab, size_t size) {
  const int ranks = base::size(MPI_COMM_WORLD);
  const int mine = static_cast<int>(size);
  std::vector<int> counts(ranks), starts(ranks, 0);
  MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, MPI_COMM_WORLD);
  for (int r = 1; r < ranks; ++r) starts[r] = starts[r - 1] + counts[r - 1];
  std::vector<double> all(starts.back() + counts.back());
  MPI_Allgatherv(slab, mine, MPI_DOUBLE, all.data(), counts.data(), starts.data(), MPI_DOUBLE,
                 MPI_COMM_WORLD);
  return all;
}
inline std::vector<double> gather(const std::vector<double>& slab) {
  return gather(slab.data(), slab.size());
}
inline std::vector<Vec3> gather(const std::vector<Vec3>& slab) {
  const std::vector<double> flat =
      gather(slab.empty() ? nullptr : slab.data()->data(), 3 * slab.size());
  std::vector<Vec3> all(flat.size() / 3);
  for (size_t i = 0; i < all.size(); ++i) all[i] = Eigen::Map<const Vec3>(&flat[3 * i]);
  return all;
}

}  // namespace repose::testing
