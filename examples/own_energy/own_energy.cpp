/// A face with an energy term of one's own: a pressure on the skin, W = −Σ f·(x − X), as of a mask.
/// The scene is built and solved by the library and written as by repose-solve.
///
///     own_energy meshes/paper_jaw_advance.yaml -pressure 0.002        (writes own_energy.h5)
#include <Eigen/Geometry>

#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/model/build.h"
#include "repose/results/result_file.h"
#include "repose/solve/repose.h"

using namespace repose;

/// Each triangle of the skin is pressed against its normal, a third of it at each corner.
void press(model::Model& model, double pressure) {
  const std::vector<Vec3>& x = model.points.position;
  for (const Triangle& t : model.skin) {
    const Vec3 area = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]) / 2;
    for (const int64_t corner : t) model.points.external_force[corner] -= pressure * area / 3;
  }
}

base::Exit run(const base::Options& options) {
  model::Model model;
  solve::Settings settings;
  settings.weights = {1, mechanics::VolumeTerm::penalty, 1.0};
  base::on_first_rank(MPI_COMM_WORLD, [&] {
    const scene::Scene scene = scene::read_scene(options.arguments()[0]);
    model = model::build_model(model::load_anatomy(scene)).model;
    press(model, options.number("pressure"));
  });
  results::ResultFile file(MPI_COMM_WORLD, "own_energy", model);
  const solve::Summary summary = solve::find_repose(
      MPI_COMM_WORLD, model, settings, {},
      [&](const model::StepNumbers& n, const model::StepRows& rows) { file.append(n, rows); });
  file.commit();
  return summary.path.complete() ? base::Exit::done : base::Exit::not_converged;
}

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Solves a scene under a pressure on the skin.",
                        {{"SCENE", "scene (.yaml)"}},
                        {{.name = "pressure",
                          .kind = base::OptionKind::number,
                          .default_text = "0",
                          .help = "Its size.",
                          .unit = "N/mm²"}});
  return base::run_program(options, [&] { return run(options); });
}
