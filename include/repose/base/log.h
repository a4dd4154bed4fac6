#pragma once
#include <petsclog.h>

/// What PETSc's log (-log_view) tells of this program: events inside stages. Nothing is collective,
/// and without the log nothing costs more than a test.
namespace repose::base {

/// The event of that name, registered when first asked for, −1 without PETSc: keep it in a static
/// of the function.
PetscLogEvent log_event(const char* name);

/// An event from here to the end of the scope, with floating-point operations done in it.
class Logged {
 public:
  explicit Logged(PetscLogEvent event, double flops = 0);
  ~Logged();
  Logged(const Logged&) = delete;
  Logged& operator=(const Logged&) = delete;

 private:
  PetscLogEvent event_;
};

/// A stage from here to the end of the scope.
class LogStage {
 public:
  explicit LogStage(const char* name);
  ~LogStage();
  LogStage(const LogStage&) = delete;
  LogStage& operator=(const LogStage&) = delete;
};

}  // namespace repose::base
