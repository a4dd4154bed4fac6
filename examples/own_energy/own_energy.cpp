/// A face with an energy term of one's own: a pressure that follows the skin, as of air in a mask.
/// Derivatives are taken automatically; the scene is built and solved by the library, its result
/// written as by repose-solve, and every number of it recomputed.
///
///     own_energy meshes/paper_jaw_advance.yaml -pressure 0.002        (writes own_energy.h5)
#include <Eigen/Geometry>

#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/discrete/natural_rows.h"
#include "repose/mechanics/term.h"
#include "repose/model/build.h"
#include "repose/results/result_file.h"
#include "repose/solve/repose.h"
#include "repose/tools/check/check_file.h"

using namespace repose;

/// The energy of one triangle of the skin: the pressure times the volume between it and the origin.
struct Pressure {
  static constexpr int points = 3, numbers = 1;
  template <class Number>
  static Number energy(const mechanics::Corners<Number, points>& x, std::span<const double> n) {
    return n[0] / 6 * x[0].dot(x[1].cross(x[2]));
  }
};

base::Exit run(const base::Options& options) {
  mechanics::add_term<Pressure>("pressure");
  model::Model model;
  solve::Settings settings;
  settings.weights = {1, mechanics::VolumeTerm::penalty, 1.0};
  base::on_root(MPI_COMM_WORLD, [&] {
    const scene::Scene scene = scene::read_scene(options.arguments()[0]);
    model = model::build_model(model::load_anatomy(scene)).model;
    model::TermElements skin{"pressure", Pressure::points, Pressure::numbers, {}, {}};
    for (const Triangle& t : model.skin) skin.points.insert(skin.points.end(), t.begin(), t.end());
    skin.numbers.assign(model.skin.size(), options.number("pressure"));
    model.elements.push_back(std::move(skin));
  });
  const discrete::LocalModel local =
      discrete::build_local_from_root(MPI_COMM_WORLD, std::move(model));
  results::ResultFile file(MPI_COMM_WORLD, "own_energy", local.global_metadata,
                           discrete::NaturalRows::of_model(MPI_COMM_WORLD, local));
  const solve::Summary summary =
      solve::RestSolver(MPI_COMM_WORLD, local.part, settings)
          .find(settings, {}, [&](const model::StepNumbers& n, const model::StepRows& rows) {
            file.append(n, rows);
          });
  file.commit();
  base::on_root(MPI_COMM_WORLD, [] {
    const tools::check::Comparison comparison = tools::check::check_file("own_energy.h5");
    if (comparison.disagreeing() > 0) base::refuse("{} is wrong", comparison.worst());
  });
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
