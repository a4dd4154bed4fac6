#pragma once
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "repose/base/log.h"

namespace repose::app {

/// A line on a terminal about work that does not count itself: what it is, and for how many seconds
/// it has run. Shown from the third second on, by a thread of rank 0, until the end of the scope.
class Phase {
 public:
  Phase(MPI_Comm comm, std::string text);
  ~Phase();
  Phase(const Phase&) = delete;
  Phase& operator=(const Phase&) = delete;

  void end();  ///< before the end of the scope

 private:
  void run();

  base::Progress progress_;
  std::string text_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace repose::app
