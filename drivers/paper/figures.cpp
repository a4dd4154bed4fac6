#include "figures.h"

#include <fmt/format.h>

#include "repose/app/settings.h"
#include "repose/base/whole_file.h"
#include "repose/mechanics/spring_law.h"
#include "repose/model/build.h"
#include "repose/results/result_file.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"

namespace repose::paper {

namespace {

const MPI_Comm alone = PETSC_COMM_SELF;

/// F_i of every local point at the initial positions.
std::vector<Vec3> initial_forces(const discrete::Part& part) {
  discrete::Positions positions(alone, part);
  discrete::Objective objective(positions, {});
  positions.update(positions.make_vector());
  return objective.residual_force();
}

/// The skin's springs under tension, all others as they lie.
void strain_skin(model::Model& model, double turgor) {
  for (size_t e = 0; e < model.springs.points.size(); ++e)
    if (model.spring_sets[model.springs.set[e]] == "layer 0")
      model.springs.rest_length[e] /= 1 + turgor;
}

}  // namespace

void write_laws(const std::filesystem::path& file) {
  constexpr int steps = 60;
  constexpr double longest = 1.5;  // mm
  std::string text = "s,linear,quadratic,quartic\n";
  for (int k = -steps; k <= steps; ++k) {
    const double s = longest * k / steps;
    text +=
        fmt::format("{:.4g},{:.6g},{:.6g},{:.6g}\n", s, mechanics::spring_tension<0>(s, 1, 1),
                    mechanics::spring_tension<1>(s, 1, 1), mechanics::spring_tension<2>(s, 1, 1));
  }
  base::write_whole_file(file, text);
}

void write_equilibrium(scene::Scene scene, const std::filesystem::path& file) {
  constexpr double turgor = 0.1, layer_mass = 0.1;  // strain, kg
  scene.tissue.turgor = turgor;
  scene.tissue.mass.assign(scene.tissue.layers, layer_mass);
  scene.gravity = Vec3(0, 0, -9.80665);
  model::Model model = model::build_model(scene).model;
  model::Model strained = model;
  strain_skin(strained, turgor);
  solve::prestress(alone, model, {turgor, model.gravity});
  const discrete::Part part = discrete::build_local_from_root(alone, model).part;
  const std::vector<Vec3> before =
      initial_forces(discrete::build_local_from_root(alone, strained).part);
  const std::vector<Vec3> after = initial_forces(part);
  std::string text = "x,y,z,before_x,before_y,before_z,after_x,after_y,after_z,layer\n";
  for (int64_t i = 0; i < part.owned_points; ++i) {
    if (part.unknown[i] < 0) continue;
    for (const Vec3& v : {part.model.points.position[i], before[i], after[i]})
      text += fmt::format("{:.6g},{:.6g},{:.6g},", v.x(), v.y(), v.z());
    text += fmt::format("{}\n", part.model.points.layer[i]);
  }
  base::write_whole_file(file, text);
}

bool write_rest(const scene::Scene& scene, const std::filesystem::path& name) {
  const model::Model model = model::build_model(scene).model;
  scene::Solve requested = scene.solve;
  requested.volume = scene::VolumeTerm::penalty;
  requested.bulk_modulus =
      model::default_bulk_modulus(scene.tissue, requested, model::effective_modulus(model));
  const solve::Settings settings = app::settings_of(requested, false);
  results::ResultFile file(alone, name, model, model::all_rows(model));
  const solve::Summary summary =
      solve::find_repose(alone, model, settings, {},
                         [&](const model::StepNumbers& numbers, const model::StepRows& rows) {
                           file.append(numbers, rows);
                         });
  file.commit();
  return summary.path.complete();
}

}  // namespace repose::paper
