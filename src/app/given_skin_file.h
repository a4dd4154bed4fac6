#pragma once
#include "self_contact.h"

namespace repose::app {

/// Writes the displacement of the given skin, in the place of which another was solved, to
/// NAME_given_skin.vtp and into the result NAME.h5. `now`, on rank 0, are the points of the solved
/// skin. Returns a row of the closing table; empty where the given skin was solved itself.
/// InputError where the disk refuses. Collective.
std::string write_given_skin(MPI_Comm comm, const Job& job, const std::string& name,
                             const SolvedSkin& skin, const std::vector<Vec3>& now);

}  // namespace repose::app
