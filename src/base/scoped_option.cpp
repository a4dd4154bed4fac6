#include "repose/base/options.h"

#include "repose/base/petsc.h"

namespace repose::base {

ScopedOption::ScopedOption(const char* name, const std::string& value) : name_(name) {
  char text[128] = "";
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsGetString(nullptr, nullptr, name, text, sizeof text, &given));
  if (given) before_ = text;
  check(PetscOptionsSetValue(nullptr, name, value.c_str()));
}

ScopedOption::~ScopedOption() {
  if (before_.empty())
    PetscOptionsClearValue(nullptr, name_);
  else
    PetscOptionsSetValue(nullptr, name_, before_.c_str());
}

}  // namespace repose::base
