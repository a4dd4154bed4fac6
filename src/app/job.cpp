#include "job.h"

#include <algorithm>
#include <functional>

#include "report.h"
#include "repose/app/settings.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/base/hdf5.h"
#include "repose/discrete/model_rows.h"
#include "repose/model/cut.h"
#include "repose/model/material.h"
#include "repose/model/skin_mesh.h"
#include "repose/results/model_file.h"
#include "repose/surface/read.h"

namespace repose::app {

namespace {

using Watch = std::function<void(double)>;

/// Share of reading, completing and cutting surfaces in the time of building.
constexpr double share_of_surfaces = 0.6;

model::ColumnGeometry lay_out(model::Anatomy& anatomy, const std::filesystem::path& input) {
  try {
    return model::build_on_solvable_skin(
        anatomy, [](const model::Anatomy& on) { return model::ColumnGeometry(on); });
  } catch (const model::RefusedPlaces& refused) {
    const std::string file = input.stem().string() + "_refused.ply";
    surface::write_ply(file, refused.places());
    base::refuse("{} (these places are in {})", refused.what(), file);
  }
}

/// Takes over what a scene states before its model is built. On rank 0.
void read_scene(const scene::Scene& scene, Job& job) {
  job.anatomy = model::load_anatomy(scene);
  job.tearing = scene.tearing;
  job.requested = scene.solve;
  job.reference_state = reference_state_of(scene);
  job.initial_equilibrium = job.reference_state.has_value();
}

/// Brings the tissue of a distributed model into its initial equilibrium. Collective.
void bring_into_equilibrium(MPI_Comm comm, Job& job) {
  solve::ReferenceState reference_state = job.reference_state.value_or(solve::ReferenceState{});
  base::broadcast(comm, job.initial_equilibrium, reference_state);
  if (!job.initial_equilibrium) return;
  job.reference_state = reference_state;
  job.building += describe_prestress(solve::prestress(comm, job.local_model, reference_state));
}

/// Returns whether the tension of an initial equilibrium is to open incisions, on all ranks.
/// Collective.
bool opens_incisions(MPI_Comm comm, const Job& job) {
  bool opens = job.initial_equilibrium && !std::ranges::all_of(job.cuts, &model::Cut::lips);
  base::broadcast(comm, opens);
  return opens;
}

/// Takes over what the builder says of a model. On rank 0.
void take_report(const model::ColumnGeometry& geometry, int ranks, Job& job) {
  const scene::Scene& scene = job.anatomy->scene;
  model::BuildReport report = geometry.report();
  const std::string adhesion = model::remark_on_adhesion(scene, job.local_model.global_metadata);
  if (!adhesion.empty()) report.remarks.push_back(adhesion);
  report.effective_modulus = job.local_model.effective_modulus;
  job.building = describe_build(geometry.skin(), report);
  if (ranks > 1) job.building += report_row("built", "by {} ranks, each its part", ranks);
  job.warnings = std::move(report.warnings);
}

std::string describe_cuts(const model::ColumnGeometry& geometry, size_t first) {
  std::vector<int64_t> doubled(geometry.cuts().size(), 0);
  for (const model::DoubledColumn& at : geometry.doubled()) doubled[at.cut] += at.points;
  std::string text;
  for (size_t i = first; i < doubled.size(); ++i)
    text += describe_cut(geometry.cuts()[i], doubled[i]);
  return text;
}

/// Sets the bulk modulus of a model of springs where none is requested. On rank 0.
void set_bulk_modulus(double effective_modulus, Job& job) {
  if (job.requested.bulk_modulus) return;
  const scene::Tissue tissue = job.anatomy ? job.anatomy->scene.tissue : scene::Tissue{};
  job.requested.bulk_modulus =
      model::default_bulk_modulus(tissue, job.requested, effective_modulus);
}

/// Builds a scene's model. Where tension opens incisions, it is built without them, balanced, and
/// built again with them and the balanced edges and volumes. Collective.
void build(MPI_Comm comm, const std::filesystem::path& input, const scene::SceneChanges& changes,
           Job& job) {
  std::optional<model::ColumnGeometry> geometry;  // on rank 0
  base::on_root(comm, [&] {
    geometry.emplace(lay_out(*job.anatomy, input));
    job.held = geometry->held();
    job.cuts = {geometry->cuts().begin(), geometry->cuts().end()};
  });
  scene::Scene scene;
  base::collective_try(comm, [&] {
    scene = base::rank(comm) == 0 ? job.anatomy->scene : scene::read_scene(input, changes);
  });
  job.material = scene.tissue.material;
  const model::ColumnGeometry* columns = geometry ? &*geometry : nullptr;
  const bool opens = opens_incisions(comm, job);
  if (geometry) geometry->include_incisions(!opens);
  job.local_model = discrete::build_local(comm, columns, scene);
  base::on_root(comm, [&] {
    take_report(*geometry, base::size(comm), job);
    job.building += describe_cuts(*geometry, 0);
    if (!job.local_model.part.solid) set_bulk_modulus(job.local_model.effective_modulus, job);
  });
  bring_into_equilibrium(comm, job);
  if (!opens) return;
  const size_t lips = geometry ? geometry->cuts().size() : 0;
  if (geometry) geometry->include_incisions(true);
  job.local_model = discrete::build_local(comm, columns, scene, &job.local_model);
  if (geometry) job.building += describe_cuts(*geometry, lips);
  job.initial_equilibrium = false;
}

/// Reads the rows of a model file that this rank holds, all valid, and the effective modulus of
/// all, on rank 0. Collective.
model::Model read_rows(MPI_Comm comm, const std::filesystem::path& input,
                       double& effective_modulus) {
  model::Model rows;
  try {
    base::collective_try(
        comm, [&] { rows = results::read_model_rows(input, base::rank(comm), base::size(comm)); });
    effective_modulus = discrete::validate(comm, rows, input.string());
  } catch (const base::InputError&) {
    // Read whole, the model shows which array and row are the first at fault, if any is.
    rows = {};
    base::on_root(comm, [&] {
      rows = results::read_model(input);
      effective_modulus = model::effective_modulus(rows);
    });
  }
  return rows;
}

/// Collective.
void read(MPI_Comm comm, const std::filesystem::path& input, const Watch& watch,
          const scene::SceneChanges& changes, Job& job) {
  base::on_root(comm, [&] {
    if (base::is_hdf5(input)) return;
    read_scene(scene::read_scene(input, changes), job);
    if (watch) watch(share_of_surfaces);
  });
  bool is_scene = job.anatomy.has_value();
  base::broadcast(comm, is_scene);
  if (is_scene) return build(comm, input, changes, job);
  double effective_modulus = 0;
  model::Model rows = read_rows(comm, input, effective_modulus);
  base::on_root(comm, [&] {
    job.requested.bulk_modulus = results::last_bulk_modulus(input);  // solved again, it stays so
    set_bulk_modulus(effective_modulus, job);
  });
  job.local_model = discrete::build_local(comm, std::move(rows));
}

/// After the initial equilibrium, which would balance the tone again. Collective.
void give_tone(MPI_Comm comm, Job& job) {
  model::RingMuscle muscle;
  if (job.anatomy) muscle = model::ring_muscle(job.anatomy->scene);
  base::broadcast(comm, muscle);
  discrete::Part& part = job.local_model.part;
  if (muscle.tone != 0) model::add_tone(muscle, part.point_row, part.owned_points, part.model);
}

/// Broadcasts rank 0's flags and counts to all ranks.
void share(MPI_Comm comm, Job& job) {
  static_assert(std::is_trivially_copyable_v<scene::Solve>);
  job.remeshed = job.anatomy && job.anatomy->given_skin;
  for (const model::Body& body : job.local_model.global_metadata.contact.bodies)
    job.bodies.push_back(body.name);
  base::broadcast(comm, job.requested, job.remeshed, job.initial_equilibrium);
}

}  // namespace

Job read_job(MPI_Comm comm, const std::filesystem::path& input, const Watch& watch,
             const scene::SceneChanges& changes) {
  Job job;
  read(comm, input, watch, changes, job);
  give_tone(comm, job);
  share(comm, job);
  return job;
}

}  // namespace repose::app
