/// repose-decimate MESH: fewest triangles within a proven distance of a mesh.
///
///     repose-decimate skull.ply -distance 0.5 -output skull_coarse.ply
///     repose-decimate skull.ply -triangles 5000 -output skull_5000.ply
///
/// Writes a PLY. Exit status: 0 done, 1 bad input (nothing written), 3 internal error.
#include <cmath>
#include <cstdio>

#include "repose/base/log.h"
#include "repose/base/program.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/defects.h"
#include "repose/surface/read.h"
#include "repose/tools/decimation/decimate.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  return {{"distance", OptionKind::number, "",
           "No point of the result is farther than this from the input (proven).",
           base::Range::above(0), "mm"},
          {"triangles", OptionKind::integer, "",
           "Stop at this many triangles; without -distance the distance reached is printed.",
           base::Range::at_least(4)},
          {"landmarks", OptionKind::path, "",
           "Points whose nearest vertices stay (.mrk.json, .fcsv, .csv)."},
          {"output", OptionKind::path, "decimated.ply", "The file to write (PLY)."}};
}

tools::decimation::DecimateOptions requested(const base::Options& options) {
  tools::decimation::DecimateOptions requested;
  const std::filesystem::path output = options.text("output");
  if (base::lower(output.extension().string()) != ".ply")
    base::refuse("-output {}: the result is written as PLY; give a name that ends in .ply",
                 output.string());
  base::reserve_output(output);
  if (!options.has("distance") && !options.has("triangles"))
    base::refuse("neither -distance nor -triangles is given; say how far, e.g. -distance 0.5 (mm)");
  if (options.has("distance")) requested.distance = options.number("distance");
  if (options.has("triangles")) requested.triangles = options.integer("triangles");
  if (options.has("landmarks"))
    for (const auto& landmark : scene::read_landmarks(options.text("landmarks")))
      requested.landmarks.push_back(landmark.position);
  return requested;
}

void print(const char* what, const surface::Surface& surface) {
  std::printf("  %-16s %zu triangles, %zu vertices; %s\n", what, surface.triangles.size(),
              surface.points.size(), describe(surface::inspect(surface)).c_str());
}

void print(const tools::decimation::Decimated& result,
           const tools::decimation::DecimateOptions& requested) {
  if (std::isfinite(requested.distance))
    std::printf("  bound asked      %g mm\n", requested.distance);
  std::printf("  bound proven     %.6g mm from the result to the input (reached: %.6g mm)\n",
              result.to_input.upper, result.to_input.lower);
  std::printf("  the other way    %.4g mm from the input to the result, not bounded\n",
              result.from_input.upper);
  for (size_t i = 0; i < result.landmark_distance.size(); ++i)
    std::printf("  landmark %-7zu %.4g mm from the vertex that stays for it\n", i + 1,
                result.landmark_distance[i]);
}

void run(const base::Options& options) {
  const tools::decimation::DecimateOptions choice = requested(options);
  const surface::Surface input = surface::load_surface(options.arguments()[0], surface::Role::mesh);
  print("input", input);
  base::Progress progress(MPI_COMM_WORLD);
  const auto before = static_cast<double>(input.triangles.size());
  const tools::decimation::Decimated result =
      tools::decimation::decimate(input, choice, [&](int64_t left) {
        progress.show(fmt::format("decimating: {} triangles left ({:.1f} %)", left,
                                  100 * static_cast<double>(left) / before),
                      -1);
      });
  progress.clear();
  print("result", result.surface);
  print(result, choice);
  surface::write_ply(options.text("output"), result.surface);
  std::printf("  wrote            %s\n", options.text("output").c_str());
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Fewest triangles within a proven distance of a mesh.",
                        {{"MESH", "a manifold triangle mesh, open or closed (PLY, STL, OBJ, OFF)"}},
                        option_table());
  return base::run_serial_program(options, run);
}
