#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "repose/base/log.h"

namespace repose::app {

/// A line on a terminal about work outside a search: what it is, for how many seconds it has run,
/// and, where the share that is done is known, a bar and the time left. Shown from the third second
/// on, by a thread of rank 0, until the end of the scope.
class Phase {
 public:
  Phase(MPI_Comm comm, std::string text);
  ~Phase();
  Phase(Phase&&) = delete;

  void at(double done);  ///< the share that is done, in (0, 1)
  void end();            ///< before the end of the scope

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  base::Progress progress_;
  std::string text_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
  Clock::time_point start_ = Clock::now();
  double done_ = -1, reached_ = 0;  // the last share, and when it was reached, s
  std::thread thread_;
};

}  // namespace repose::app
