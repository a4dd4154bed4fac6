/// Reads damaged files: every reader refuses them in words or takes them, and neither crashes nor
/// runs on nor asks for memory that the file's size does not justify.
///
///     fuzz [INPUTS a target] [SEED] [TARGET]
///
/// Slow readers get a part of the inputs. Each target is read in a process of its own, which is
/// started again after a crash. What went wrong is kept as fuzz_TARGET_NUMBER in the working
/// folder. Exit status 1 where anything did.
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "mutation.h"
#include "repose/base/petsc.h"
#include "targets.h"

namespace repose::fuzz {
namespace {

/// Progress that the processes share.
struct Progress {
  uint64_t next, refused, taken;
};

/// Reads inputs from progress.next on; a way out that is none of those allowed ends the process.
void read_on(const Target& target, uint64_t number, uint64_t seed, uint64_t inputs,
             const std::filesystem::path& folder, Progress& progress) {
  constexpr itimerval patience{{0, 0}, {10, 0}};  // of the processor's time, ends by SIGPROF
#ifndef __SANITIZE_ADDRESS__
  // The sanitizer's shadow takes terabytes of addresses.
  constexpr rlim_t memory = rlim_t{8} << 30;
  const rlimit limit{memory, memory};
  setrlimit(RLIMIT_AS, &limit);
#endif
  const std::filesystem::path file = folder / target.file;
  for (; progress.next < inputs; ++progress.next) {
    write(file, Mutation(seed, number, progress.next).of(target.seeds));
    setitimer(ITIMER_PROF, &patience, nullptr);
    ++(taken(target, file) ? progress.taken : progress.refused);
  }
}

/// Returns the number of inputs that went wrong.
uint64_t run(const Target& target, uint64_t number, uint64_t seed, uint64_t inputs,
             const std::filesystem::path& folder) {
  constexpr uint64_t max_findings = 20;
  auto* progress = static_cast<Progress*>(
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  uint64_t findings = 0;
  while (progress->next < inputs && findings < max_findings) {
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
      read_on(target, number, seed, inputs, folder, *progress);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) continue;
    ++findings;
    const std::filesystem::path kept =
        fmt::format("fuzz_{}_{}_{}", target.name, progress->next,
                    std::filesystem::path(target.file).filename().string());
    std::printf("%s: input %llu ends with %s %d, kept as %s\n", target.name.c_str(),
                static_cast<unsigned long long>(progress->next),
                WIFSIGNALED(status) ? "signal" : "status",
                WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status), kept.c_str());
    write(kept, Mutation(seed, number, progress->next).of(target.seeds));
    ++progress->next;
  }
  std::printf("%-10s %10llu inputs, %10llu refused in words, %10llu taken, %llu wrong\n",
              target.name.c_str(), static_cast<unsigned long long>(progress->next),
              static_cast<unsigned long long>(progress->refused),
              static_cast<unsigned long long>(progress->taken),
              static_cast<unsigned long long>(findings));
  return findings;
}

int run_all(uint64_t inputs, uint64_t seed, const std::string& only) {
  const results::Folder folder;
  add_neighbors(folder.path("."));
  uint64_t findings = 0, number = 0;
  for (const Target& target : targets(folder.path("."))) {
    if (only.empty() || only == target.name)
      findings +=
          run(target, number, seed, static_cast<uint64_t>(target.share * inputs), folder.path("."));
    ++number;
  }
  return findings > 0 ? 1 : 0;
}

}  // namespace
}  // namespace repose::fuzz

int main(int argc, char** argv) {
  char* no_arguments[] = {argv[0], nullptr};
  const repose::base::Session session(1, no_arguments);
  const uint64_t inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 2000;
  const uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  return repose::fuzz::run_all(inputs, seed, argc > 3 ? argv[3] : "");
}
