/// CPU time of choosing the region of a raw skin that is solved, and of remeshing it.
///
///     repose-isosurface head_hu.mhd -level -300 -largest -output skin.ply
///     benchmark_face skin.ply mandible.ply
///
/// The second mesh is the bone that moves. Edges of 4 mm.
#include <algorithm>
#include <array>
#include <cstdio>

#include "repose/base/program.h"
#include "repose/meshtools/face.h"
#include "repose/surface/read.h"

int main(int argc, char** argv) {
  using namespace repose;
  constexpr int runs = 5;
  if (argc != 3) {
    std::fputs("benchmark_face SKIN BONE\n", stderr);
    return 1;
  }
  const surface::Surface skin = surface::read_surface(argv[1]);
  const meshtools::FaceRequest request{.edge = 4, .beneath = {surface::read_surface(argv[2])}};
  std::array<double, runs> seconds;
  size_t vertices = 0;
  for (double& one : seconds) {
    const double start = base::cpu_seconds();
    vertices = meshtools::solvable_face(skin, request).skin.points.size();
    one = base::cpu_seconds() - start;
  }
  std::sort(seconds.begin(), seconds.end());
  std::printf(
      "%zu triangles to %zu vertices: %.2f s of CPU time, median of %d runs (%.2f … %.2f)\n",
      skin.triangles.size(), vertices, seconds[runs / 2], runs, seconds[0], seconds[runs - 1]);
}
