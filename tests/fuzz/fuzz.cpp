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

#include <cstdio>
#include <cstdlib>
#include <functional>

#include "mutation.h"
#include "repose/base/petsc.h"
#include "repose/imaging/volume.h"
#include "repose/results/model_file.h"
#include "repose/scene/landmarks.h"
#include "repose/scene/scene.h"
#include "repose/scene/transform_file.h"
#include "repose/surface/read.h"
#include "seeds.h"

namespace repose::fuzz {
namespace {

struct Target {
  std::string name, ending;
  std::vector<std::string> seeds;
  std::function<void(const std::filesystem::path&)> read;
  double share = 1;  // of the inputs
};

void read_result(const std::filesystem::path& file) {
  const model::Model model = results::read_model(file);
  for (int64_t step = 0; step < results::step_count(file); ++step)
    results::read_step(file, step, model);
}

std::vector<Target> targets(const std::filesystem::path& folder) {
  using surface::ply_binary;
  const auto surface = [](const auto& file) { surface::read_surface(file); };
  const auto volume = [](const auto& file) { imaging::read_volume(file); };
  const auto landmarks = [](const auto& file) { scene::read_landmarks(file); };
  const surface::Surface s = tetrahedron();
  return {
      {"scene", ".yaml", shipped(".yaml"), [](const auto& file) { scene::read_scene(file); }, 0.5},
      {"ply", ".ply", {ply_text(s), ply_binary(s, false), ply_binary(s, true)}, surface},
      {"stl", ".stl", {surface::stl_text(s), surface::stl_binary(s)}, surface},
      {"obj", ".obj", {obj_text(s) + "f -4/1/1 -3//2 -2 -1\n"}, surface},
      {"off", ".off", {off_text(s)}, surface},
      {"transform", ".tfm", transforms(), [](const auto& file) { scene::read_transform(file); }},
      {"markups", ".mrk.json", shipped(".json"), landmarks, 0.5},
      {"fcsv", ".fcsv", tables_of_landmarks(), landmarks},
      {"model", ".h5", models(folder), read_result, 0.1},
      {"meta", ".mha", metas(), volume},
      {"nrrd", ".nrrd", nrrds(), volume},
      {"nifti", ".nii", niftis(), volume},
  };
}

/// What the processes share.
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
  const std::filesystem::path file = folder / ("input" + target.ending);
  for (; progress.next < inputs; ++progress.next) {
    write(file, Mutation(seed, number, progress.next).of(target.seeds));
    setitimer(ITIMER_PROF, &patience, nullptr);
    try {
      target.read(file);
      ++progress.taken;
    } catch (const base::InputError& refusal) {
      if (std::string(refusal.what()).find('\n') != std::string::npos) {
        std::fprintf(stderr, "refused in several lines: %s\n", refusal.what());
        std::abort();
      }
      ++progress.refused;
    }
  }
}

/// Returns the number of inputs that went wrong.
uint64_t run(const Target& target, uint64_t number, uint64_t seed, uint64_t inputs,
             const std::filesystem::path& folder) {
  constexpr uint64_t most_findings = 20;
  auto* progress = static_cast<Progress*>(
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  uint64_t findings = 0;
  while (progress->next < inputs && findings < most_findings) {
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
    const std::string kept =
        fmt::format("fuzz_{}_{}{}", target.name, progress->next, target.ending);
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

/// What scenes name is there.
void link_shipped(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(REPOSE_MESHES))
    std::filesystem::create_symlink(entry.path(), folder / entry.path().filename());
}

int run_all(uint64_t inputs, uint64_t seed, const std::string& only) {
  const results::Folder folder;
  link_shipped(folder.path("."));
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
  const repose::base::Session session(1, no_arguments, nullptr);
  const uint64_t inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 2000;
  const uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  return repose::fuzz::run_all(inputs, seed, argc > 3 ? argv[3] : "");
}
