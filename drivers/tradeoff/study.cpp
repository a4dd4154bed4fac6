#include "study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "label.h"
#include "repose/adapt/coarse_model.h"
#include "repose/app/settings.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/base/options.h"
#include "repose/base/program.h"
#include "repose/discrete/gather.h"
#include "repose/meshtools/remesh.h"
#include "repose/model/build.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"
#include "skin.h"
#include "ways.h"

namespace repose::tradeoff {

namespace {

const MPI_Comm comm = MPI_COMM_WORLD;
constexpr double patience = 4;  // time limits of a run that a reference may take
const double unknown = std::numeric_limits<double>::quiet_NaN();

/// What a run left behind, the positions on rank 0.
struct Run {
  Measurement measurement;
  std::vector<Vec3> position;
};

/// A model of the scene, and its own rest position found to the reference's accuracy, if it was.
struct Discretisation {
  model::Model model;  // on rank 0
  double bulk_modulus = 0;
  std::vector<Vec3> rest;  // on rank 0
};

class Study {
 public:
  Study(const Plan& plan, const Tell& tell) : plan_(plan), tell_(tell) {}

  Findings run() {
    base::on_first_rank(comm, [&] { load(); });
    choose_edges();
    const std::vector<Way> ways = ways_of(plan_);
    prepare(ways);
    for (size_t k = 0; k < ways.size(); ++k) {
      tell_(fmt::format("{}: {}", ways[k].study, label(ways[k])), k + 1, ways.size());
      add(ways[k]);
    }
    return std::move(findings_);
  }

 private:
  using Key = std::tuple<int, double, scene::VolumeTerm>;  // layers, edge, volume term
  static Key key_of(const Way& way) { return {way.layers, way.edge, way.volume}; }

  /// The anatomy and the scene's own model, of whose material the others are made. On rank 0.
  void load() {
    const scene::Scene& scene = plan_.scene;
    const std::string file = scene.file.string();
    const bool varied = std::any_of(plan_.layers.begin(), plan_.layers.end(),
                                    [&](int layers) { return layers != scene.tissue.layers; });
    if (varied && !adapt::layers_are_free(scene.tissue))
      base::refuse(
          "{}: tissue.depths, tissue.mass or a set of springs is for {} layers; -layers cannot "
          "vary them, leave it empty",
          file, scene.tissue.layers);
    if (!scene.incisions.empty())
      base::refuse("{}: incisions are not compared; take the key out for this study", file);
    if (scene.solve.functional == scene::Functional::force)
      base::refuse("{}: functional force is not compared; take the key out for this study", file);
    anatomy_ = model::load_anatomy(scene);
    own_ = model::build_model(anatomy_).model;
  }

  void choose_edges() {
    if (plan_.edges) return;
    double edge = base::rank(comm) == 0 ? meshtools::even_edge(anatomy_.skin) : 0;
    MPI_Bcast(&edge, 1, MPI_DOUBLE, 0, comm);
    plan_.edges = {std::round(15 * edge) / 10, std::round(20 * edge) / 10};
  }

  /// The scene's tissue, or springs that resemble its material.
  scene::Tissue tissue_of(const Way& way) const {
    scene::Tissue tissue = plan_.scene.tissue;
    if (tissue.material && way.volume != scene::VolumeTerm::material) {
      tissue.isotropic = tissue.material->deep;
      tissue.material.reset();
    }
    return tissue;
  }

  /// The scene's own model, or one of the same material at another resolution. On rank 0.
  model::Model build(const Way& way) const {
    const bool own = way.volume == scene::VolumeTerm::material || !plan_.scene.tissue.material;
    if (own && way.edge == 0 && way.layers == plan_.scene.tissue.layers) return own_;
    model::Anatomy anatomy = anatomy_;
    anatomy.scene.tissue = tissue_of(way);
    return adapt::coarse_model(anatomy, own_, {way.edge, way.layers}).model;
  }

  /// The reference: the most layers, the skin as it is, the scene's volume term.
  void prepare(const std::vector<Way>& ways) {
    Way finest = usual_way(plan_);
    for (const Way& way : ways) finest.layers = std::max(finest.layers, way.layers);
    tell_("the reference", 0, ways.size());
    const Discretisation& reference = discretisation(finest);
    base::on_first_rank(comm, [&] {
      if (reference.rest.empty())
        base::refuse(
            "the reference, with {} layers, does not come to {:g} mm in {:g} s; raise -time_limit "
            "or -reference, or take fewer -layers",
            finest.layers, plan_.reference_accuracy, patience * plan_.seconds);
      skin_.emplace(reference.model, reference.rest);
      findings_.map.rest = skin_->rest();
      findings_.map.triangles = skin_->triangles();
    });
  }

  const Discretisation& discretisation(const Way& way) {
    const auto known = known_.find(key_of(way));
    if (known != known_.end()) return known->second;
    Discretisation& made = known_[key_of(way)];
    base::on_first_rank(comm, [&] {
      made.model = build(way);
      made.bulk_modulus = plan_.scene.solve.bulk_modulus.value_or(
          model::default_bulk_modulus(tissue_of(way), plan_.scene.solve, made.model));
    });
    MPI_Bcast(&made.bulk_modulus, 1, MPI_DOUBLE, 0, comm);
    bring_into_equilibrium(made.model);
    Way closely = usual_way(plan_);
    closely.volume = way.volume;
    closely.accuracy = plan_.reference_accuracy;
    Run run = solve_as(closely, made, patience * plan_.seconds);
    if (run.measurement.converged) made.rest = std::move(run.position);
    return made;
  }

  void bring_into_equilibrium(model::Model& model) const {
    if (const auto recording = app::recording_of(plan_.scene))
      solve::prestress(comm, model, *recording);
  }

  solve::Settings settings_of(const Way& way, double bulk_modulus) const {
    scene::Solve wanted = plan_.scene.solve;
    const bool solid = way.volume == scene::VolumeTerm::material;
    if (!solid) wanted.volume = way.volume;
    wanted.bulk_modulus = bulk_modulus;
    wanted.accuracy = way.accuracy;
    wanted.load_steps = way.load_steps;
    return app::settings_of(wanted, solid);
  }

  Run solve_as(const Way& way, const Discretisation& made, double limit) const {
    const base::ScopedOption method("-tao_type", way.method);
    Run run;
    run.measurement.way = way;
    const double begin = base::cpu_seconds();
    base::Interrupt end(comm, limit, false);
    solve::Settings settings = settings_of(way, made.bulk_modulus);
    settings.interrupt = &end;
    const solve::Summary summary =
        solve::find_repose(comm, made.model, settings, {},
                           [&](const model::StepNumbers&, const model::StepRows& rows) {
                             run.position = discrete::gather_points(comm, rows.position);
                           });
    Measurement& m = run.measurement;
    m.seconds = base::cpu_seconds() - begin;
    MPI_Allreduce(MPI_IN_PLACE, &m.seconds, 1, MPI_DOUBLE, MPI_MAX, comm);
    m.points = static_cast<int64_t>(made.model.points.position.size());
    m.unknowns = summary.unknowns;
    m.converged = summary.path.complete();
    m.reason = summary.last.reason;
    m.evaluations = summary.evaluations;
    m.assemblies = summary.assemblies;
    m.iterations = summary.path.iterations;
    m.estimate = summary.last.displacement_error;
    if (summary.path.load < 1) run.position.clear();
    return run;
  }

  void add(const Way& way) {
    const Discretisation& made = discretisation(way);
    Run run = solve_as(way, made, plan_.seconds);
    base::on_first_rank(comm, [&] {
      Measurement& m = run.measurement;
      m.error = m.skin_rms = m.skin_95 = m.skin_max = unknown;
      if (!run.position.empty()) compare(run, made);
      findings_.measurements.push_back(m);
    });
  }

  void compare(Run& run, const Discretisation& made) {
    Measurement& m = run.measurement;
    if (made.rest.size() == run.position.size()) {
      m.error = 0;
      for (size_t i = 0; i < made.rest.size(); ++i)
        m.error = std::max(m.error, (made.rest[i] - run.position[i]).norm());
    }
    std::vector<double> off = skin_->distances(made.model, run.position);
    if (m.way.study != "solver") {
      findings_.map.ways.push_back(m.way);
      findings_.map.error.push_back(off);
    }
    std::sort(off.begin(), off.end());
    double squares = 0;
    for (const double d : off) squares += d * d;
    m.skin_rms = std::sqrt(squares / static_cast<double>(off.size()));
    m.skin_95 = off[(off.size() - 1) * 95 / 100];
    m.skin_max = off.back();
  }

  Plan plan_;
  const Tell& tell_;
  model::Anatomy anatomy_;  // on rank 0
  model::Model own_;        // on rank 0
  std::map<Key, Discretisation> known_;
  std::optional<Skin> skin_;  // on rank 0
  Findings findings_;
};

}  // namespace

Findings measure(const Plan& plan, const Tell& tell) { return Study(plan, tell).run(); }

}  // namespace repose::tradeoff
