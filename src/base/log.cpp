#include "repose/base/log.h"

#include "repose/base/petsc.h"

namespace repose::base {

PetscLogEvent log_event(const char* name) {
  PetscLogEvent event = -1;
  check(PetscLogEventRegister(name, PETSC_OBJECT_CLASSID, &event));
  return event;
}

Logged::Logged(PetscLogEvent event, double flops) : event_(event) {
  check(PetscLogEventBegin(event_, nullptr, nullptr, nullptr, nullptr));
  if (flops > 0) check(PetscLogFlops(flops));
}

Logged::~Logged() { PetscLogEventEnd(event_, nullptr, nullptr, nullptr, nullptr); }

LogStage::LogStage(const char* name) {
  PetscLogStage stage = -1;
  check(PetscLogStageGetId(name, &stage));
  if (stage < 0) check(PetscLogStageRegister(name, &stage));
  check(PetscLogStagePush(stage));
}

LogStage::~LogStage() { PetscLogStagePop(); }

}  // namespace repose::base
