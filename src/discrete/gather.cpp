#include "repose/discrete/gather.h"

#include <numeric>

#include "repose/base/agreement.h"

namespace repose::discrete {

std::vector<double> gather(MPI_Comm comm, const double* values, size_t count) {
  const int own = static_cast<int>(count), size = base::size(comm);
  std::vector<int> counts(size), starts(size + 1, 0);
  MPI_Gather(&own, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm);
  std::partial_sum(counts.begin(), counts.end(), starts.begin() + 1);
  std::vector<double> all(starts.back());
  MPI_Gatherv(values, own, MPI_DOUBLE, all.data(), counts.data(), starts.data(), MPI_DOUBLE, 0,
              comm);
  return all;
}

std::vector<Vec3> gather_points(MPI_Comm comm, const std::vector<Vec3>& slab) {
  const std::vector<double> numbers =
      gather(comm, slab.empty() ? nullptr : slab.data()->data(), 3 * slab.size());
  std::vector<Vec3> points(numbers.size() / 3);
  for (size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Map<const Vec3>(&numbers[3 * i]);
  return points;
}

}  // namespace repose::discrete
