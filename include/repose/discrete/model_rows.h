#pragma once
#include <mpi.h>

#include <string>

#include "repose/model/model.h"

namespace repose::discrete {

/// Refuses what model::validate refuses of a model whose rows lie on the ranks as for
/// build_local(), and what a rank's rows alone do not show to be valid. Returns
/// model::effective_modulus, the same on any number of ranks. InputError, whose rows are those of
/// one rank. Collective.
double validate(MPI_Comm comm, model::Model& rows, const std::string& file);

}  // namespace repose::discrete
