#include "repose/base/log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::base {

PetscLogEvent log_event(const char* name) {
  PetscLogEvent event = -1;
  PetscBool runs = PETSC_FALSE;  // a program may use the library's serial parts without PETSc
  check(PetscInitialized(&runs));
  if (!runs) return event;
  check(PetscLogEventRegister(name, PETSC_OBJECT_CLASSID, &event));
  return event;
}

Logged::Logged(PetscLogEvent event, double flops) : event_(event) {
  if (event_ < 0) return;
  check(PetscLogEventBegin(event_, nullptr, nullptr, nullptr, nullptr));
  if (flops > 0) check(PetscLogFlops(flops));
}

Logged::~Logged() {
  if (event_ >= 0) PetscLogEventEnd(event_, nullptr, nullptr, nullptr, nullptr);
}

LogStage::LogStage(const char* name) {
  PetscLogStage stage = -1;
  check(PetscLogStageGetId(name, &stage));
  if (stage < 0) check(PetscLogStageRegister(name, &stage));
  check(PetscLogStagePush(stage));
}

LogStage::~LogStage() { PetscLogStagePop(); }

namespace {

std::string duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  return fmt::format("{:.0f} min", seconds / 60);
}

/// A bar of ten cells in front of a line; empty where the share is unknown.
std::string bar(double done) {
  if (done < 0) return "";
  const int cells = static_cast<int>(10 * std::clamp(done, 0.0, 1.0));
  return fmt::format("[{:.<10}] ", std::string(cells, '#'));
}

/// Cuts a line off where a terminal at stderr ends; what wraps around could not be cleared.
std::string fit_terminal(std::string line) {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 && line.size() >= size.ws_col)
    line.resize(size.ws_col - 1);
  return line;
}

/// Returns whether stderr is shown on a terminal: it is one, or mpirun, which started this
/// process with a pipe for stderr, passes it on to one.
bool watched() {
  if (isatty(STDERR_FILENO)) return true;
  if (!std::getenv("OMPI_COMM_WORLD_SIZE")) return false;
  const std::string shown = fmt::format("/proc/{}/fd/{}", getppid(), STDERR_FILENO);
  const int file = open(shown.c_str(), O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return false;
  const bool terminal = isatty(file);
  close(file);
  return terminal;
}

}  // namespace

Progress::Progress(MPI_Comm comm) : visible_(rank(comm) == 0 && watched()) {}

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
  std::fputs(("\r\033[K" + fit_terminal(bar(done) + text + left)).c_str(), stderr);
  std::fflush(stderr);
}

void Progress::clear() {
  if (!shown_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  shown_ = false;
}

}  // namespace repose::base
