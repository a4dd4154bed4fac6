#pragma once
#include <mpi.h>

#include <string>

#include "repose/model/model.h"

namespace repose::discrete {

/// Refuses what model::validate refuses of a model whose rows lie on the ranks as for
/// build_local(). The rows in a refusal are those of one rank. InputError. Collective.
void validate(MPI_Comm comm, model::Model& rows, const std::string& file);

/// Returns model::effective_modulus of these rows, which are valid, the same on any number of
/// ranks, on all ranks. Collective.
double effective_modulus(MPI_Comm comm, model::Model& rows);

}  // namespace repose::discrete
