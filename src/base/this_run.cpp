#include "repose/base/this_run.h"

#include <hdf5.h>

#include <fstream>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::base {

namespace {

/// The command line, words that hold a space in quotes; empty where there is no /proc.
std::string command_line() {
  std::ifstream stream("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(stream, word, '\0');) {
    const bool quoted = word.empty() || word.find_first_of(" \t\n'\"$&;*?") != std::string::npos;
    words.push_back(quoted ? fmt::format("'{}'", word) : word);
  }
  return fmt::format("{}", fmt::join(words, " "));
}

}  // namespace

std::vector<std::pair<std::string, std::string>> this_run(MPI_Comm comm) {
  unsigned major = 0, minor = 0, release = 0;
  H5get_libversion(&major, &minor, &release);
  return {{"program", "Repose " REPOSE_VERSION},
          {"command", command_line()},
          {"ranks", std::to_string(size(comm))},
          {"libraries",
           fmt::format("PETSc {}.{}.{}, HDF5 {}.{}.{}", PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR,
                       PETSC_VERSION_SUBMINOR, major, minor, release)}};
}

}  // namespace repose::base
