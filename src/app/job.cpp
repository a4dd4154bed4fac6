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

using Watch = std::function<void(double)>;

/// Share of reading, completing and cutting surfaces in the time of building.
constexpr double share_of_surfaces = 0.6;

/// A model or its ground, from an anatomy.
template <class Made>
Made make(model::Anatomy& anatomy, const std::filesystem::path& input) {
  try {
    return model::build_on_solvable_skin(anatomy, [](const model::Anatomy& on) {
      if constexpr (std::is_same_v<Made, model::Ground>)
        return model::Ground(on);
      else
        return model::build_model(on);
    });
  } catch (const model::RefusedPlaces& refused) {
    const std::string file = input.stem().string() + "_refused.ply";
    surface::write_ply(file, refused.places());
    base::refuse("{} (these places are in {})", refused.what(), file);
  }
}

/// Why rank 0 builds the model whole, or nothing where every rank makes its part.
std::string why_whole(MPI_Comm comm, const model::Anatomy& anatomy, const std::string& wish) {
  constexpr size_t worth_a_part = 8;  // columns a rank
  if (!wish.empty()) return wish;
  if (anatomy.skin.points.size() < worth_a_part * static_cast<size_t>(base::size(comm)))
    return "its skin has few vertices";
  return model::beyond_columns(anatomy.scene);
}

/// Takes over what a scene states before its model is built. On rank 0.
void read_scene(const scene::Scene& scene, Job& job) {
  job.anatomy = model::load_anatomy(scene);
  job.tearing = scene.tearing;
  job.wanted = scene.solve;
  job.recording = recording_of(scene);
  job.initial_equilibrium = job.recording.has_value();
}

/// On rank 0.
void build(const std::filesystem::path& input, Job& job) {
  model::BuiltModel built = make<model::BuiltModel>(*job.anatomy, input);
  job.model = std::move(built.model);
  job.held = std::move(built.held);
  job.cuts = std::move(built.cuts);
  job.building = describe_build(built.report);
  job.warnings = std::move(built.report.warnings);
}

/// Every rank makes its part. Collective.
void raise(MPI_Comm comm, const std::filesystem::path& input, Job& job) {
  std::optional<model::Ground> ground;  // on rank 0
  base::on_first_rank(comm, [&] { ground.emplace(make<model::Ground>(*job.anatomy, input)); });
  scene::Scene scene;
  base::together(
      comm, [&] { scene = base::rank(comm) == 0 ? job.anatomy->scene : scene::read_scene(input); });
  job.layers = scene.tissue.layers;
  job.raised = discrete::raise(comm, ground ? &*ground : nullptr, std::move(scene));
  base::on_first_rank(comm, [&] {
    model::BuildReport report = ground->report();
    report.effective_modulus = job.raised->effective_modulus;
    job.building = describe_build(report) +
                   report_row("built", fmt::format("by {} ranks, each its part", base::size(comm)));
    job.warnings = std::move(report.warnings);
    job.model = std::move(job.raised->frame);
  });
}

/// Collective.
void read(MPI_Comm comm, const std::filesystem::path& input, const std::string& whole,
          const Watch& watch, Job& job) {
  bool raised = false;
  const bool shared = base::size(comm) > 1;
  base::on_first_rank(comm, [&] {
    if (results::is_hdf5(input)) {
      job.model = results::read_model(input);
      job.wanted.bulk_modulus = results::last_bulk_modulus(input);  // solved again, it stays so
      return;
    }
    read_scene(scene::read_scene(input), job);
    if (watch) watch(share_of_surfaces);
    const std::string why = why_whole(comm, *job.anatomy, whole);
    raised = shared && why.empty();
    if (raised) return;
    build(input, job);
    if (shared) job.building += report_row("built", fmt::format("by rank 0, whole: {}", why));
  });
  MPI_Bcast(&raised, 1, MPI_C_BOOL, 0, comm);
  if (raised) raise(comm, input, job);
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
  job.building +=
      describe_prestress(job.raised ? solve::prestress(comm, job.raised->part, recording)
                                    : solve::prestress(comm, job.model, recording));
}

/// Gives all ranks what rank 0 knows and all have to know.
void share(MPI_Comm comm, Job& job) {
  static_assert(std::is_trivially_copyable_v<scene::Solve>);
  job.solid = job.raised || model::is_solid(job.model);
  job.remeshed = job.anatomy && job.anatomy->given_skin;
  job.touches = job.raised ? job.raised->part.contact : !job.model.contact.empty();
  for (const model::Body& body : job.model.contact.bodies) job.bodies.push_back(body.name);
  MPI_Bcast(&job.wanted, sizeof job.wanted, MPI_BYTE, 0, comm);
  for (bool* flag : {&job.solid, &job.touches, &job.remeshed, &job.initial_equilibrium})
    MPI_Bcast(flag, 1, MPI_C_BOOL, 0, comm);
}

}  // namespace

Job read_job(MPI_Comm comm, const std::filesystem::path& input, const std::string& whole,
             const Watch& watch) {
  Job job;
  read(comm, input, whole, watch, job);
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
