#pragma once
#include <mpi.h>

#include <string>
#include <utility>
#include <vector>

namespace repose::base {

/// What a result is to be traced back by, as (name, text): "program" with its version, "command" as
/// it was typed (where the system tells), "ranks", "libraries" with their versions. Not collective;
/// PETSc must be initialised.
std::vector<std::pair<std::string, std::string>> this_run(MPI_Comm comm);

}  // namespace repose::base
