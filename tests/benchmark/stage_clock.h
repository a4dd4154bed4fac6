#pragma once
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>

#include "repose/base/agreement.h"
#include "repose/base/program.h"

/// Cost of the stages of a program, over the ranks of MPI_COMM_WORLD.
namespace repose::benchmark {

/// Most bytes that were resident since the last restart() (Linux).
inline double peak_bytes() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word)
    if (word == "VmHWM:") break;
  double kibibytes = 0;
  status >> kibibytes;
  return 1024 * kibibytes;
}

/// Prints for each stage its name, the CPU seconds of the slowest rank, and the most memory in use
/// during it: of all ranks together, of rank 0, and of the largest other; bytes.
class Clock {
 public:
  Clock() { restart(); }
  void end(const char* stage, int64_t goes = 1) {
    double seconds = (base::cpu_seconds() - begin_) / static_cast<double>(goes);
    const double mine = peak_bytes();
    double all = 0, other = base::rank(MPI_COMM_WORLD) == 0 ? 0 : mine;
    MPI_Allreduce(MPI_IN_PLACE, &seconds, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    MPI_Allreduce(MPI_IN_PLACE, &other, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    if (base::rank(MPI_COMM_WORLD) == 0)
      std::printf("%s %.9f %.0f %.0f %.0f\n", stage, seconds, all, mine, other);
    std::fflush(stdout);
    restart();
  }

 private:
  void restart() {
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak starts again
    begin_ = base::cpu_seconds();
  }
  double begin_ = 0;
};

}  // namespace repose::benchmark
