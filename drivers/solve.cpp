/// repose-solve INPUT: from a scene (.yaml) or a model (.h5) to the rest position of the tissue.
///
///     repose-solve meshes/head_jaw_opening.yaml
///     mpirun -n 2 repose-solve meshes/head_jaw_opening.yaml -accuracy 0.01 -output opening
///     repose-solve opening.h5 -tao_type lmvm -tao_monitor
///
/// Writes NAME.h5 and one XDMF file a block for ParaView. Exit status: 0 converged, 1 bad input
/// (nothing written), 2 not converged or folded (result written), 3 internal error.
///
/// Order of a solve: app/job.h reads and builds,
/// app/strategy.h decides what goes with what (-dry_run prints it), app/run.h solves and writes.
#include "repose/app/options.h"
#include "repose/app/run.h"
#include "repose/base/program.h"

int main(int argc, char** argv) {
  using namespace repose;
  base::Options options(argc, argv,
                        "Finds the rest position of facial soft tissue after its bones moved.",
                        {{"INPUT", "scene (.yaml) or model (.h5)"}}, app::solve_options());
  return base::run_program(options, [&] { return app::run(options); });
}
