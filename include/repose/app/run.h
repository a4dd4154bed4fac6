#pragma once
#include "repose/base/error.h"
#include "repose/base/options.h"

namespace repose::app {

/// All of repose-solve: reads and builds the job, chooses its strategy, solves it and writes the
/// result, under one deadline. `options` are solve_options() and one argument, the input.
/// Collective.
base::Exit run(const base::Options& options);

}  // namespace repose::app
