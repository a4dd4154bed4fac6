#include "repose/base/program.h"

#include <hdf5.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <optional>
#include <thread>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::base {

namespace {

void print(std::FILE* where, const std::string& line) {
  if (rank(MPI_COMM_WORLD) == 0) std::fprintf(where, "%s\n", line.c_str());
  std::fflush(where);
}

/// Prints one line and ends all ranks, some of which may be unaware that one has failed.
int abandon(const std::string& line, Exit status) {
  constexpr std::chrono::seconds while_the_first_prints{1};
  int started = 0;
  MPI_Initialized(&started);
  const bool first = !started || rank(MPI_COMM_WORLD) == 0;
  if (!first) std::this_thread::sleep_for(while_the_first_prints);
  std::fprintf(stderr, "%s\n", line.c_str());
  std::fflush(stderr);
  if (started && size(MPI_COMM_WORLD) > 1) MPI_Abort(MPI_COMM_WORLD, static_cast<int>(status));
  return static_cast<int>(status);
}

int internal_error(const std::exception& error) {
  std::fprintf(stderr, "internal error on rank %d: %s\n", rank(MPI_COMM_WORLD), error.what());
  std::fflush(stderr);
  if (size(MPI_COMM_WORLD) > 1) MPI_Abort(MPI_COMM_WORLD, static_cast<int>(Exit::internal_error));
  return static_cast<int>(Exit::internal_error);
}

int guarded(Options& options, const std::function<Exit()>& work) {
  try {
    options.check();
    for (const std::string& line : options.repeated())
      print(stderr, fmt::format("warning: {}", line));
    const Exit status = work();
    for (const std::string& name : options.unused())
      print(stderr, fmt::format("warning: option {} was not used", name));
    return static_cast<int>(status);
  } catch (const InputError& e) {
    print(stderr, fmt::format("error: {}", e.what()));
    return static_cast<int>(Exit::bad_input);
  } catch (const PetscError& e) {
    if (options.petsc_settings().empty()) return internal_error(e);
    return abandon(fmt::format("error: PETSc fails with the options {}: {}; leave out those that "
                               "it does not take",
                               options.petsc_settings(), e.what()),
                   Exit::bad_input);
  } catch (const std::exception& e) {
    return internal_error(e);
  }
}

/// Ends a program that PETSc does not start in, of which some ranks may be unaware.
int leave(const InputError& error) {
  const int status = abandon(fmt::format("error: {}", error.what()), Exit::bad_input);
  int started = 0;
  MPI_Initialized(&started);
  if (started) MPI_Finalize();
  return status;
}

}  // namespace

int run_program(Options& options, const std::function<Exit()>& work) {
  std::optional<Session> session;
  try {
    session.emplace(options.petsc_argc(), options.petsc_argv());
  } catch (const InputError& error) {
    return leave(error);
  }
  if (options.help_requested()) {
    print(stdout, options.help());
    return static_cast<int>(Exit::done);
  }
  if (options.version_requested()) {
    const auto run = this_run(MPI_COMM_WORLD);
    print(stdout, run.front().second);
    print(stdout, run.back().second);
    return static_cast<int>(Exit::done);
  }
  return guarded(options, work);
}

int run_serial_program(Options& options, Exit (*work)(const Options&)) {
  return run_program(options, [&] {
    Exit exit = Exit::done;
    on_root(MPI_COMM_WORLD, [&] { exit = work(options); });
    return exit;
  });
}

int run_serial_program(Options& options, void (*work)(const Options&)) {
  return run_program(options, [&] {
    on_root(MPI_COMM_WORLD, [&] { work(options); });
    return Exit::done;
  });
}

double heap_bytes() {
  const auto use = mallinfo2();
  return static_cast<double>(use.uordblks) + static_cast<double>(use.hblkhd);
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::string machine() {
  const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                        static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 30);
  return fmt::format("{} cores, {:.0f} GiB of memory", std::thread::hardware_concurrency(), memory);
}

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

std::filesystem::path shipped_folder(const std::string& name) {
  std::error_code error;
  const std::filesystem::path bin =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const std::filesystem::path& place :
       {std::filesystem::path(name), bin / "../share/repose" / name, bin / "../.." / name})
    if (std::filesystem::is_directory(place, error)) return place.lexically_normal();
  return name;
}

void Stages::end(const std::string& name) {
  const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double mebibytes = static_cast<double>(usage.ru_maxrss) / 1024;
  stages_.push_back({name, max_over_ranks(comm_, seconds), sum_over_ranks(comm_, mebibytes)});
  begin_ = Clock::now();
}

}  // namespace repose::base
