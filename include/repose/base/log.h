#pragma once
#include <mpi.h>
#include <petsclog.h>
#include <chrono>
#include <string>

/// Events and stages of this program in PETSc's log (-log_view). Nothing is collective,
/// and without the log nothing costs more than a test.
namespace repose::base {

/// The event of that name, registered when first requested, −1 without PETSc: keep it in a static
/// of the function.
PetscLogEvent log_event(const char* name);

/// An event from here to the end of the scope, with floating-point operations done in it.
class Logged {
 public:
  explicit Logged(PetscLogEvent event, double flops = 0);
  ~Logged();
  Logged(Logged&&) = delete;

 private:
  PetscLogEvent event_;
};

/// A stage from here to the end of the scope.
class LogStage {
 public:
  explicit LogStage(const char* name);
  ~LogStage();
  LogStage(LogStage&&) = delete;
};

/// One line on a terminal that is written over as work continues, with the time it will still take;
/// nothing at all where neither stderr nor that of mpirun is a terminal, and on ranks other than
/// the first.
class Progress {
 public:
  explicit Progress(MPI_Comm comm);
  ~Progress();  ///< clears the line

  bool visible() const { return visible_; }
  /// Shows `text`, at most ten times a second. `done` in [0, 1] gives a bar and the time left; < 0:
  /// unknown.
  void show(const std::string& text, double done);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool visible_ = false;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now(), last_{};
};

}  // namespace repose::base
