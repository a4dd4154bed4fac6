#pragma once
#include <mpi.h>

#include <chrono>
#include <string>

namespace repose::base {

/// One line on a terminal that is written over as work goes on, with the time it will still take;
/// nothing at all where neither stderr nor that of mpirun is a terminal, and on ranks other than
/// the first.
class Progress {
 public:
  explicit Progress(MPI_Comm comm);
  ~Progress();  ///< clears the line

  bool visible() const { return visible_; }
  /// Shows `text`, at most ten times a second. `done` in [0, 1] gives the time left; < 0: unknown.
  void show(const std::string& text, double done);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool visible_ = false;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now(), last_{};
};

}  // namespace repose::base
