#pragma once
#include <functional>

#include "repose/base/collective.h"

namespace repose::base {

/// Runs `work` on every rank (or on rank 0 only) and agrees on the outcome: if it threw anywhere,
/// every rank throws the same error (that of the lowest rank, InputError or InternalError kept).
/// No rank is left waiting in a collective that another never reaches. Collective.
void collective_try(MPI_Comm comm, const std::function<void()>& work);
void on_root(MPI_Comm comm, const std::function<void()>& work);

}  // namespace repose::base
