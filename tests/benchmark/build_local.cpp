/// Measures every stage of a large solid before its search, built whole by rank 0 and shared out,
/// or built by all ranks from their columns: a synthetic head with contact. Prints a
/// line a stage (stage_clock.h), of which build_local.py makes a table.
///
///     mpirun -n 2 benchmark_build_local SKIN_VERTICES FILE whole|raised
#include <optional>

#include "repose/base/petsc.h"
#include "repose/discrete/natural_rows.h"
#include "repose/discrete/objective.h"
#include "repose/model/build.h"
#include "repose/results/result_file.h"
#include "repose/tools/phantom/phantom.h"
#include "stage_clock.h"

namespace {

using namespace repose;
using benchmark::Clock;

const MPI_Comm comm = MPI_COMM_WORLD;
constexpr double bone_edge = 2;  // mm, of all heads: only the skin gets finer

/// The jaw goes forward by 6 mm.
scene::Scene jaw_advance() {
  scene::Scene scene;
  scene.bones = {{"skull", {}}, {"mandible", {}}};
  scene.tissue.layers = 4;
  scene.tissue.material = scene::Material{.deep = {0.015, 0.45}, .strata = {}, .regions = {}};
  scene.contact = scene::Contact{};
  scene.moves = {scene::RigidMotion(), scene::RigidMotion::translation({0, -6, 0})};
  return scene;
}

/// The surfaces, on rank 0.
model::Anatomy anatomy_of(int64_t skin_vertices) {
  model::Anatomy anatomy{jaw_advance(), {}, {}, {}, {}, {}};
  if (base::rank(comm) > 0) return anatomy;
  anatomy.skin = tools::phantom::make_phantom_skin(skin_vertices);
  anatomy.bones = {tools::phantom::make_phantom_skull(bone_edge),
                   tools::phantom::make_phantom_mandible(bone_edge)};
  return anatomy;
}

using File = std::optional<results::ResultFile>;

discrete::Part whole(const model::Anatomy& anatomy, const std::string& name, File& file,
                     Clock& clock) {
  model::Model model;
  if (base::rank(comm) == 0) model = model::build_model(anatomy).model;
  clock.end("build");
  discrete::LocalModel local_model = discrete::build_local_from_root(comm, std::move(model));
  clock.end("distribute");
  file.emplace(comm, name, local_model.global_metadata,
               discrete::NaturalRows::of_model(comm, local_model));
  clock.end("write");
  return std::move(local_model.part);
}

discrete::Part local_model(const model::Anatomy& anatomy, const std::string& name, File& file,
                           Clock& clock) {
  std::optional<model::ColumnGeometry> geometry;
  if (base::rank(comm) == 0) geometry.emplace(anatomy);
  clock.end("ground");
  discrete::LocalModel local_model =
      discrete::build_local(comm, geometry ? &*geometry : nullptr, anatomy.scene);
  geometry.reset();
  clock.end("raise");
  file.emplace(comm, name, local_model.global_metadata,
               discrete::NaturalRows::of_model(comm, local_model));
  clock.end("write");
  return std::move(local_model.part);
}

void measure(int64_t skin_vertices, const std::string& name, bool is_whole) {
  Clock clock;
  const model::Anatomy anatomy = anatomy_of(skin_vertices);
  clock.end("surfaces");
  File file;
  const discrete::Part part =
      is_whole ? whole(anatomy, name, file, clock) : local_model(anatomy, name, file, clock);
  if (base::rank(comm) == 0) std::printf("points %ld\n", static_cast<long>(part.total_points));
  discrete::Positions positions(comm, part);
  discrete::Objective objective(positions, mechanics::solid_weights);
  const base::VecHandle at = positions.make_vector(), gradient = positions.make_vector();
  positions.set_load(0.1);
  objective.evaluate(at, gradient);
  clock.end("evaluate");
  model::StepNumbers numbers;
  numbers.volume = model::VolumeTerm::material;
  file->append(numbers, discrete::NaturalRows(comm, part).rows(objective));
  file->commit();
  clock.end("result");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: benchmark_build_local SKIN_VERTICES FILE whole|raised\n");
    return 1;
  }
  const base::Session session(1, argv);
  measure(std::stoll(argv[1]), argv[2], std::string(argv[3]) == "whole");
  return 0;
}
