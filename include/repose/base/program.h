#pragma once
#include <functional>

#include "repose/base/error.h"
#include "repose/base/options.h"

namespace repose::base {

/// The frame of every program: starts PETSc and MPI, answers -help, checks the options, does `work`
/// and turns what it throws into one line on stderr from one rank and an exit status. An
/// InputError must be the same on all ranks; after any other error MPI is aborted, so that no rank
/// waits for another.
int run_program(Options& options, const std::function<Exit()>& work);

}  // namespace repose::base
