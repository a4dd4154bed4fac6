#include "phase.h"

#include <fmt/format.h>

#include <chrono>

namespace repose::app {

Phase::Phase(MPI_Comm comm, std::string text) : progress_(comm), text_(std::move(text)) {
  if (progress_.visible()) thread_ = std::thread(&Phase::run, this);
}

Phase::~Phase() { end(); }

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
  const auto start = std::chrono::steady_clock::now();
  std::unique_lock<std::mutex> lock(mutex_);
  if (ended_.wait_for(lock, patience, [&] { return over_; })) return;
  do {
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    progress_.show(fmt::format("{}  {:.0f} s", text_, seconds.count()), -1);
  } while (!ended_.wait_for(lock, interval, [&] { return over_; }));
}

}  // namespace repose::app
