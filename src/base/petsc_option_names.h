#pragma once
#include <string_view>

namespace repose::base {

/// Returns whether an option's name (without the dash) begins as PETSc's own do. PETSc has no list
/// to ask: solvers may be nested under prefixes, and an option is known only to the object that
/// reads it.
bool begins_as_petsc(std::string_view name);

}  // namespace repose::base
