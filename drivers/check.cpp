/// repose-check RESULT.h5: recomputes every number of a result file from its model and its
/// positions, by plain serial loops, and prints for each kind of number the worst of all steps
/// beside what is stored; -verbose prints all.
///
///     repose-check opening.h5
///
/// Exit status: 0 all agree to 1e-9 (gaps to meshes to 1e-5 mm), 1 the file is bad or its numbers
/// do not agree.
#include <cstdio>

#include "repose/base/program.h"
#include "repose/tools/check/check_file.h"

namespace {

using namespace repose;

void run(const base::Options& options) {
  const std::string file = options.arguments()[0];
  const tools::check::Comparison comparison = tools::check::check_file(file);
  const std::string table = options.flag("verbose") ? comparison.table() : comparison.summary();
  std::fputs(table.c_str(), stdout);
  std::fflush(stdout);
  if (comparison.disagreeing() > 0)
    base::refuse("{}: {} of {} numbers disagree, the worst: {}", file, comparison.disagreeing(),
                 comparison.compared(), comparison.worst());
  std::printf("%s: all %lld numbers agree to %g\n", file.c_str(),
              static_cast<long long>(comparison.compared()), comparison.tolerance());
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv,
                        "Recomputes every number of a result file from its model and positions.",
                        {{"RESULT.h5", "a result of repose-solve"}},
                        {{"verbose", base::OptionKind::flag, "",
                          "Print every number of every step, not one row for each kind."}});
  return base::run_serial_program(options, run);
}
