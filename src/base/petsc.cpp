#include "repose/base/petsc.h"

#include <cstdlib>

namespace repose::base {

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  char* specific = nullptr;
  PetscErrorMessage(code, &text, &specific);
  throw InternalError(fmt::format("PETSc: {}{}{} (error {})", text ? text : "unknown error",
                                  specific && *specific ? ": " : "", specific ? specific : "",
                                  static_cast<int>(code)));
}

Session::Session(int argc, char** argv, const char* help) {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
  check(PetscInitialize(&argc, &argv, nullptr, help));
  check(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
}

Session::~Session() {
  PetscPopErrorHandler();
  PetscFinalize();
}

}  // namespace repose::base
