/// repose-live SCENE: builds a scene once and answers requests about plans, JSON lines on standard
/// input and output (docs/guide/live.md).
///
///     echo '{"do": "solve", "plan": {"mandible": {"translate": [0, -3, 0]}}}' |
///       repose-live meshes/head_live.yaml
///     mpirun -n 2 repose-live meshes/head_live.yaml
///
/// Exit status: 0 after quit or the end of the input, 1 bad input, 3 internal error.
#include <unistd.h>

#include <optional>

#include "repose/base/program.h"
#include "repose/live/serve.h"

int main(int argc, char** argv) {
  using namespace repose;
  base::Options options(argc, argv, "Builds a scene once and solves it for many plans, on request.",
                        {{"SCENE", "scene (.yaml) with a plan"}},
                        {{"port", base::OptionKind::integer, "",
                          "Answer on this port of 127.0.0.1 in place of standard input; 0: "
                          "a free one. Prints port and token as JSON.",
                          base::Range::between(0, 65535)}});
  // Standard output is for answers alone: what else is printed goes to standard error.
  const int output = dup(STDOUT_FILENO);
  if (!options.help_requested()) dup2(STDERR_FILENO, STDOUT_FILENO);
  return base::run_program(options, [&] {
    std::optional<int> port;
    if (options.has("port")) port = static_cast<int>(options.integer("port"));
    return live::serve(MPI_COMM_WORLD, options.arguments()[0], {STDIN_FILENO, output, port});
  });
}
