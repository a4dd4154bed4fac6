#include "repose/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "repose/base/agreement.h"

namespace repose::base {

namespace {

std::string duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  return fmt::format("{:.0f} min", seconds / 60);
}

}  // namespace

Progress::Progress(MPI_Comm comm) : visible_(rank(comm) == 0 && isatty(STDERR_FILENO)) {}

Progress::~Progress() { clear(); }

void Progress::show(const std::string& text, double done) {
  if (!visible_) return;
  const auto now = Clock::now();
  if (shown_ && now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  shown_ = true;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  std::string left;
  if (done > 0.02 && done < 1)
    left = fmt::format("  about {} left", duration(elapsed * (1 - done) / done));
  std::fputs(fmt::format("\r\033[K{}{}", text, left).c_str(), stderr);
  std::fflush(stderr);
}

void Progress::clear() {
  if (!shown_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  shown_ = false;
}

}  // namespace repose::base
