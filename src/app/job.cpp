#include "job.h"

#include "report.h"
#include "repose/app/settings.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/model/cut.h"
#include "repose/model/skin_mesh.h"
#include "repose/results/model_file.h"
#include "repose/surface/read.h"

namespace repose::app {

namespace {

model::BuiltModel build(const model::Anatomy& anatomy, const std::filesystem::path& input) {
  try {
    return model::build_model(anatomy);
  } catch (const model::RefusedPlaces& refused) {
    const std::string file = input.stem().string() + "_refused.ply";
    surface::write_ply(file, refused.places());
    base::refuse("{} (these places are in {})", refused.what(), file);
  }
}

/// On rank 0.
void read(const std::filesystem::path& input, Job& job) {
  if (results::is_hdf5(input)) {
    job.model = results::read_model(input);
    job.wanted.bulk_modulus = results::last_bulk_modulus(input);  // solved again, it stays the same
    return;
  }
  const scene::Scene scene = scene::read_scene(input);
  job.anatomy = model::load_anatomy(scene);
  job.remeshed = job.anatomy->given_skin.has_value();
  model::BuiltModel built = build(*job.anatomy, input);
  job.model = std::move(built.model);
  job.held = std::move(built.held);
  job.cuts = std::move(built.cuts);
  job.tearing = scene.tearing;
  job.building = describe_build(built.report);
  job.wanted = scene.solve;
  job.recording = recording_of(scene);
  job.initial_equilibrium = job.recording.has_value();
}

/// Cuts the tissue as its initial equilibrium left it, so that its tension opens the cut. On rank
/// 0.
void make_incisions(Job& job) {
  for (const model::Cut& cut : job.cuts) {
    const size_t doubled = model::cut_along(cut, job.model).size();
    job.building += describe_cut(cut, static_cast<int64_t>(doubled));
    job.initial_equilibrium = false;
  }
}

void bring_into_equilibrium(MPI_Comm comm, Job& job) {
  solve::Recording recording = job.recording.value_or(solve::Recording{});
  MPI_Bcast(&job.initial_equilibrium, 1, MPI_C_BOOL, 0, comm);
  MPI_Bcast(&recording, sizeof recording, MPI_BYTE, 0, comm);
  if (!job.initial_equilibrium) return;
  job.recording = recording;
  job.building += describe_prestress(solve::prestress(comm, job.model, recording));
}

/// Gives all ranks what rank 0 knows and all have to know.
void share(MPI_Comm comm, Job& job) {
  static_assert(std::is_trivially_copyable_v<scene::Solve>);
  job.solid = model::is_solid(job.model);
  job.touches = !job.model.contact.empty();
  for (const model::Body& body : job.model.contact.bodies) job.bodies.push_back(body.name);
  MPI_Bcast(&job.wanted, sizeof job.wanted, MPI_BYTE, 0, comm);
  for (bool* flag : {&job.solid, &job.touches, &job.remeshed, &job.initial_equilibrium})
    MPI_Bcast(flag, 1, MPI_C_BOOL, 0, comm);
}

}  // namespace

Job read_job(MPI_Comm comm, const std::filesystem::path& input) {
  Job job;
  base::on_first_rank(comm, [&] { read(input, job); });
  bring_into_equilibrium(comm, job);
  base::on_first_rank(comm, [&] {
    make_incisions(job);
    if (job.wanted.bulk_modulus) return;
    const scene::Tissue tissue = job.anatomy ? job.anatomy->scene.tissue : scene::Tissue{};
    job.wanted.bulk_modulus = model::default_bulk_modulus(tissue, job.wanted, job.model);
  });
  share(comm, job);
  return job;
}

}  // namespace repose::app
