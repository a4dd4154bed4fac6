#include "repose/base/stages.h"

#include <sys/resource.h>

namespace repose::base {

void Stages::end(const std::string& name) {
  double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  double mebibytes = static_cast<double>(usage.ru_maxrss) / 1024;
  MPI_Allreduce(MPI_IN_PLACE, &seconds, 1, MPI_DOUBLE, MPI_MAX, comm_);
  MPI_Allreduce(MPI_IN_PLACE, &mebibytes, 1, MPI_DOUBLE, MPI_SUM, comm_);
  stages_.push_back({name, seconds, mebibytes});
  begin_ = Clock::now();
}

}  // namespace repose::base
