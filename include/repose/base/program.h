#pragma once
#include <mpi.h>
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/options.h"

namespace repose::base {

/// The frame of every program: starts PETSc and MPI, answers -help, checks the options, does `work`
/// and turns what it throws into one line on stderr from one rank and an exit status. An
/// InputError must be the same on all ranks; after any other error MPI is aborted, so that no rank
/// waits for another.
int run_program(Options& options, const std::function<Exit()>& work);

/// The frame of a program that does its work on rank 0 only; see run_program.
int run_serial_program(Options& options, Exit (*work)(const Options&));
int run_serial_program(Options& options, void (*work)(const Options&));

/// Bytes that this process holds on the heap, blocks mapped on their own included (glibc).
double heap_bytes();

/// CPU time of this process so far, s.
double cpu_seconds();

/// Returns the number of cores and the memory of this machine, in words.
std::string machine();

/// Returns the provenance of a result as (name, text): "program" with its version, "command" as
/// it was typed (where the system tells), "ranks", "libraries" with their versions. Not collective;
/// PETSc must be initialized.
std::vector<std::pair<std::string, std::string>> this_run(MPI_Comm comm);

/// A folder that comes with the programs, such as "meshes", wherever they are called from: the one
/// here, else where they are installed (PREFIX/bin → PREFIX/share/repose), else in the project they
/// were built in. Where there is none, its name as it is. Not collective.
std::filesystem::path shipped_folder(const std::string& name);

/// The stages of a program with the wall time each took and the peak memory by its end.
class Stages {
 public:
  explicit Stages(MPI_Comm comm) : comm_(comm) {}

  struct Stage {
    std::string name;
    double seconds;    ///< largest over ranks
    double mebibytes;  ///< peak resident memory so far, summed over ranks
  };

  /// Ends the stage under way (or the time since construction) and names it. Collective.
  void end(const std::string& name);
  const std::vector<Stage>& list() const { return stages_; }

 private:
  using Clock = std::chrono::steady_clock;
  MPI_Comm comm_;
  Clock::time_point begin_ = Clock::now();
  std::vector<Stage> stages_;
};

}  // namespace repose::base
