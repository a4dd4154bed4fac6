#include "phase.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace repose::app {

Phase::Phase(MPI_Comm comm, std::string text) : progress_(comm), text_(std::move(text)) {
  if (progress_.visible()) thread_ = std::thread(&Phase::run, this);
}

Phase::~Phase() { end(); }

void Phase::at(double done) {
  const std::lock_guard<std::mutex> lock(mutex_);
  done_ = done;
  reached_ = seconds();
}

void Phase::end() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    over_ = true;
  }
  ended_.notify_all();
  thread_.join();
  progress_.clear();
}

void Phase::run() {
  constexpr std::chrono::seconds patience{2};
  constexpr std::chrono::milliseconds interval{500};
  std::unique_lock<std::mutex> lock(mutex_);
  if (ended_.wait_for(lock, patience, [&] { return over_; })) return;
  do {
    const double now = seconds();
    // The share grows on as fast as it has so far.
    const double done = done_ > 0 ? std::min(std::max(done_, done_ * now / reached_), 0.99) : -1;
    progress_.show(fmt::format("{}  {:.0f} s", text_, now), done);
  } while (!ended_.wait_for(lock, interval, [&] { return over_; }));
}

}  // namespace repose::app
