/// Measures every stage of a large model in time and memory: a synthetic head is built,
/// written, read, shared out, evaluated, searched by 20 iterations of L-BFGS, and its step written.
/// Nothing makes a matrix. Prints a line a stage (stage_clock.h), of which large.py makes a table.
///
///     benchmark_large SKIN_VERTICES FILE
///     mpirun -n 2 benchmark_large SKIN_VERTICES FILE
#include <petsctao.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"
#include "repose/discrete/natural_rows.h"
#include "repose/discrete/objective.h"
#include "repose/model/build.h"
#include "repose/results/model_file.h"
#include "repose/results/result_file.h"
#include "repose/tools/phantom/phantom.h"
#include "stage_clock.h"

namespace {

using namespace repose;
using base::check;
using benchmark::Clock;

const MPI_Comm comm = MPI_COMM_WORLD;
constexpr double bone_edge = 2;  // mm, of all heads: only the skin gets finer

/// The jaw goes forward by 6 mm.
scene::Scene jaw_advance() {
  scene::Scene scene;
  scene.bones = {{"skull", {}}, {"mandible", {}}};
  scene.tissue.layers = 4;
  scene.moves = {scene::RigidMotion(), scene::RigidMotion::translation({0, -6, 0})};
  return scene;
}

/// Writes the model of a head with so many skin vertices, on rank 0.
void make_model(int64_t skin_vertices, const std::string& name, Clock& clock) {
  surface::Surface skin;
  std::vector<surface::Surface> bones;
  if (base::rank(comm) == 0) {
    skin = tools::phantom::make_phantom_skin(skin_vertices);
    bones = {tools::phantom::make_phantom_skull(bone_edge),
             tools::phantom::make_phantom_mandible(bone_edge)};
  }
  clock.end("surfaces");
  model::Model model;
  if (base::rank(comm) == 0) model = model::build_model(jaw_advance(), skin, bones).model;
  clock.end("build");
  const discrete::LocalModel local = discrete::build_local_from_root(comm, std::move(model));
  results::ResultFile file(comm, name, local.global_metadata,
                           discrete::NaturalRows::of_model(comm, local));
  file.commit();
  clock.end("write");
}

PetscErrorCode evaluate(Tao, Vec x, PetscReal* value, Vec gradient, void* objective) {
  *value = static_cast<discrete::Objective*>(objective)->evaluate(x, gradient);
  return 0;
}

using TaoHandle = base::Handle<Tao, TaoDestroy>;

/// Some iterations of L-BFGS; what it holds is there as long as the handle.
TaoHandle search(discrete::Objective& objective, Vec displacement) {
  TaoHandle tao;
  check(TaoCreate(comm, tao.out()));
  check(TaoSetType(tao, TAOLMVM));
  check(TaoSetObjectiveAndGradient(tao, nullptr, evaluate, &objective));
  check(TaoSetMaximumIterations(tao, 20));
  check(TaoSetSolution(tao, displacement));
  check(TaoSolve(tao));
  return tao;
}

void measure(int64_t skin_vertices, const std::string& name) {
  Clock clock;
  make_model(skin_vertices, name, clock);
  model::Model model;
  if (base::rank(comm) == 0) model = results::read_model(name + ".h5");
  clock.end("read");
  const model::Counts counts = model::count(model);
  if (base::rank(comm) == 0)
    std::printf("counts %ld %ld\n", static_cast<long>(counts.points),
                static_cast<long>(counts.springs));
  const discrete::LocalModel local = discrete::build_local_from_root(comm, std::move(model));
  const discrete::Part& part = local.part;
  discrete::Positions positions(comm, part);
  const discrete::NaturalRows natural(comm, part);
  clock.end("distribute");
  results::ResultFile file(comm, name, local.global_metadata,
                           discrete::NaturalRows::of_model(comm, local));
  clock.end("open");
  const mechanics::Weights weights{1, mechanics::VolumeTerm::penalty, 0.5};
  discrete::Objective objective(positions, weights);
  const base::VecHandle at = positions.make_vector(), gradient = positions.make_vector();
  positions.set_load(0.1);
  clock.end("objective");
  const int64_t goes = 1 + 20000000 / std::max<int64_t>(part.total_springs, 1);
  objective.evaluate(at, gradient);
  for (int64_t go = 0; go < goes; ++go) objective.evaluate(at, gradient);
  clock.end("evaluation", goes + 1);
  const TaoHandle tao = search(objective, at);
  clock.end("search");
  model::StepNumbers numbers;
  numbers.volume = model::VolumeTerm::penalty;
  file.append(numbers, natural.rows(objective));
  file.commit();
  clock.end("result");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: benchmark_large SKIN_VERTICES FILE\n");
    return 1;
  }
  const base::Session session(1, argv);
  measure(std::stoll(argv[1]), argv[2]);
  return 0;
}
