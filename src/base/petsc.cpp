#include "repose/base/petsc.h"

#include <fmt/ranges.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string_view>
#include <vector>

#include "mpi_environment.h"
#include "repose/base/options.h"

namespace repose::base {

namespace {

std::exception_ptr kept;  // by keep_exception()

/// PETSc's own words for an error, the general and the particular ones.
std::string text_of(PetscErrorCode code) {
  const char* text = nullptr;
  char* specific = nullptr;
  PetscErrorMessage(code, &text, &specific);
  std::vector<std::string_view> words;
  for (const char* part : {text, static_cast<const char*>(specific)})
    if (part && *part) words.emplace_back(part);
  if (words.empty()) words.emplace_back("unknown error");
  return fmt::format("{} (error {})", fmt::join(words, ": "), static_cast<int>(code));
}

/// Who reads no further does not end the work: writing fails, without a signal.
void ignore_broken_pipes() {
  sigset_t pipe;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
}

}  // namespace

void check(PetscErrorCode code) {
  if (code == 0) return;
  if (kept) std::rethrow_exception(std::exchange(kept, nullptr));
  throw PetscError("PETSc: " + text_of(code));
}

void keep_exception() { kept = std::current_exception(); }

void check_options(PetscErrorCode code) {
  if (code == 0) return;
  const std::string text = text_of(code);
  for (const auto& [name, value] : petsc_options())
    if (!value.empty() && text.find(" " + value + " ") != std::string::npos)
      refuse("-{} {}: PETSc does not take this value: {}", name, value, text);
  refuse("PETSc does not take an option's value: {}", text);
}

Session::Session(int argc, char** argv) {
  set_mpi_variables();
  // With more, models are shared out over ranks in another way in every run (Scotch 7).
  setenv("SCOTCH_PTHREAD_NUMBER", "1", 0);
  ignore_broken_pipes();
  // PETSc takes these for faults, of which it prints a page.
  constexpr std::array kept{SIGTERM, SIGHUP};
  std::array<struct sigaction, kept.size()> actions{};
  for (size_t k = 0; k < kept.size(); ++k) sigaction(kept[k], nullptr, &actions[k]);
  check(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
  if (const PetscErrorCode code = PetscInitialize(&argc, &argv, nullptr, nullptr))
    refuse("PETSc does not start with its options (command line, -options_file, PETSC_OPTIONS): {}",
           text_of(code));
  // PETSc 3.22 lists unused options on standard output by default, even when Repose refuses one.
  PetscBool asked = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, "-options_left", &asked));
  if (!asked) check(PetscOptionsSetValue(nullptr, "-options_left", "no"));
  for (size_t k = 0; k < kept.size(); ++k) sigaction(kept[k], &actions[k], nullptr);
}

Session::~Session() {
  // PETSc flushes it, and takes a broken pipe or a full disk there for a fault.
  if (std::fflush(stdout) != 0 && !std::freopen("/dev/null", "w", stdout)) std::fclose(stdout);
  PetscFinalize();
}

}  // namespace repose::base
