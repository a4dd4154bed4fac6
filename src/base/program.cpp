#include "repose/base/program.h"

#include <cstdio>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::base {

namespace {

void say(std::FILE* where, const std::string& line) {
  if (rank(MPI_COMM_WORLD) == 0) std::fprintf(where, "%s\n", line.c_str());
  std::fflush(where);
}

int guarded(Options& options, const std::function<Exit()>& work) {
  try {
    options.check();
    const Exit status = work();
    for (const std::string& name : options.unused())
      say(stderr, fmt::format("warning: option {} was not used", name));
    return static_cast<int>(status);
  } catch (const InputError& e) {
    say(stderr, fmt::format("error: {}", e.what()));
    return static_cast<int>(Exit::bad_input);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "internal error on rank %d: %s\n", rank(MPI_COMM_WORLD), e.what());
    std::fflush(stderr);
    if (size(MPI_COMM_WORLD) > 1) MPI_Abort(MPI_COMM_WORLD, static_cast<int>(Exit::internal_error));
    return static_cast<int>(Exit::internal_error);
  }
}

}  // namespace

int run_program(Options& options, const std::function<Exit()>& work) {
  Session session(options.petsc_argc(), options.petsc_argv(), nullptr);
  if (options.help_wanted()) {
    say(stdout, options.help());
    return static_cast<int>(Exit::done);
  }
  return guarded(options, work);
}

}  // namespace repose::base
