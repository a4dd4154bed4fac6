/// The readers under libFuzzer, which looks for inputs that go new ways through the code (preset
/// fuzz, clang):
///
///     REPOSE_READER=ply build-fuzz/bin/fuzz_coverage CORPUS -max_total_time=60
///
/// CORPUS is a folder; an empty one gets the valid files that the seeded run begins with. Without
/// REPOSE_READER the program lists the readers.
#include "repose/base/petsc.h"
#include "targets.h"

namespace repose::fuzz {
namespace {

class Reader {
 public:
  explicit Reader(const std::string& name) {
    add_neighbors(folder_.path("."));
    for (const Target& target : targets(folder_.path(".")))
      if (target.name == name)
        target_ = target;
      else
        names_ += " " + target.name;
    if (target_.read) return;
    std::fprintf(stderr, "REPOSE_READER must be one of%s\n", names_.c_str());
    std::exit(1);
  }
  void plant(const std::filesystem::path& corpus) const {
    if (!std::filesystem::is_directory(corpus) || !std::filesystem::is_empty(corpus)) return;
    for (size_t k = 0; k < target_.seeds.size(); ++k)
      write(corpus / fmt::format("seed_{}", k), target_.seeds[k]);
  }
  void read(const std::string& bytes) const {
    const std::filesystem::path file = folder_.path(target_.file);
    write(file, bytes);
    taken(target_, file);
  }

 private:
  const results::Folder folder_;
  Target target_;
  std::string names_;
};

/// Open MPI and PETSc leave faults to the sanitizers.
Reader& reader() {
  static char program[] = "fuzz_coverage", no_signals[] = "-no_signal_handler";
  static char* arguments[] = {program, no_signals, nullptr};
  static const bool quiet = setenv("OMPI_MCA_opal_signal", "", 1) == 0;
  static const base::Session session(quiet ? 2 : 1, arguments);
  const char* name = std::getenv("REPOSE_READER");
  static Reader one(name ? name : "");
  return one;
}

}  // namespace
}  // namespace repose::fuzz

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  for (int k = 1; k < *count; ++k) repose::fuzz::reader().plant((*arguments)[k]);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  repose::fuzz::reader().read({reinterpret_cast<const char*>(data), size});
  return 0;
}
