#pragma once
#include <mpi.h>

#include <chrono>
#include <string>
#include <vector>

namespace repose::base {

/// The stages of a program with the wall time each took and the peak memory by its end.
class Stages {
 public:
  explicit Stages(MPI_Comm comm) : comm_(comm) {}

  struct Stage {
    std::string name;
    double seconds;    ///< largest over ranks
    double mebibytes;  ///< peak resident memory so far, summed over ranks
  };

  /// Ends the stage under way (or the time since construction) and names it. Collective.
  void end(const std::string& name);
  const std::vector<Stage>& list() const { return stages_; }

 private:
  using Clock = std::chrono::steady_clock;
  MPI_Comm comm_;
  Clock::time_point begin_ = Clock::now();
  std::vector<Stage> stages_;
};

}  // namespace repose::base
