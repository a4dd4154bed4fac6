/// repose-collide SCENE: the contacts between bones along the planned moves, and how far the moves
/// can go without one.
///
///     repose-collide meshes/head_genioplasty.yaml
///     repose-collide scene.yaml -clearance 0.5 -tolerance 0.01
///
/// Exit status: 0 done, whether bones touch or not, 1 bad input, 3 internal error.
#include <cstdio>

#include "repose/base/program.h"
#include "repose/model/build.h"
#include "repose/model/collision.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  return {{"clearance", OptionKind::number, "", "Distance to be kept between bones (default 0).",
           base::Range::between(0, 50), "mm"},
          {"tolerance", OptionKind::number, "",
           "How much sooner than at contact the moves may end (default 0.05).",
           base::Range::between(1e-4, 10), "mm"}};
}

void report(const base::Options& options) {
  const scene::Scene scene = scene::read_scene(options.arguments()[0]);
  scene::Collision requested = scene.collision.value_or(scene::Collision{});
  if (options.has("clearance")) requested.clearance = options.number("clearance");
  if (options.has("tolerance")) requested.tolerance = options.number("tolerance");
  const model::Bones bones = model::read_bones(scene);
  for (const auto& lines : {bones.remarks, scene.remarks, bones.warnings, scene.warnings})
    for (const std::string& line : lines) std::printf("  %s\n", line.c_str());
  const double start = MPI_Wtime();
  const model::CollisionReport found = model::follow_moves(bones.surfaces, scene.moves, requested);
  for (const std::string& line : model::describe(found, scene, requested))
    std::printf("  %s\n", line.c_str());
  if (found.pairs.empty())
    std::printf("  no two bones move differently\n");
  else if (found.safe_load >= 1)
    std::printf("  the moves can be made as planned\n");
  else
    std::printf("  the moves can be made up to load %.4f\n", found.safe_load);
  std::printf("  time %.2f s\n", MPI_Wtime() - start);
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Reports contacts between bones along their planned moves.",
                        {{"SCENE", "scene file (.yaml) with moves"}}, option_table());
  return base::run_serial_program(options, report);
}
