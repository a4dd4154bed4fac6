#include "repose/base/log.h"

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

}  // namespace repose::base
