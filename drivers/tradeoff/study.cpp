#include "study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "repose/adapt/coarse_model.h"
#include "repose/app/settings.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/base/options.h"
#include "repose/base/program.h"
#include "repose/meshtools/remesh.h"
#include "repose/model/build.h"
#include "repose/model/material.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"
#include "skin.h"

namespace repose::tradeoff {

namespace {

const MPI_Comm comm = MPI_COMM_WORLD;
constexpr double patience = 4;  // time limits of a run that a reference may take
const double unknown = std::numeric_limits<double>::quiet_NaN();

/// Result of a run, with the positions on rank 0.
struct Run {
  Measurement measurement;
  std::vector<Vec3> position;
};

/// A model of the scene, and its own rest position found to the reference's accuracy, if it was.
struct Discretization {
  model::Model model;  // on rank 0
  double bulk_modulus = 0;
  std::vector<Vec3> rest;  // on rank 0
};

class Study {
 public:
  Study(const Plan& plan, const Tell& tell) : plan_(plan), tell_(tell) {}

  Findings run() {
    base::on_root(comm, [&] { load(); });
    choose_edges();
    const std::vector<Variant> variants = variants_of(plan_);
    prepare(variants);
    for (size_t k = 0; k < variants.size(); ++k) {
      tell_(fmt::format("{}: {}", variants[k].study, label(variants[k])), k + 1, variants.size());
      add(variants[k]);
    }
    return std::move(findings_);
  }

 private:
  using Key = std::tuple<int, double, scene::VolumeTerm>;  // layers, edge, volume term
  static Key key_of(const Variant& variant) {
    return {variant.layers, variant.edge, variant.volume};
  }

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
    if (scene.solve.functional == scene::Functional::force)
      base::refuse("{}: functional force is not compared; take the key out for this study", file);
    anatomy_ = model::load_anatomy(scene);
    const auto& incisions = anatomy_.scene.incisions;  // also of lips parted by landmarks
    if (!incisions.empty())
      base::refuse(
          "{}: incisions and parted lips are not compared; take the keys incisions and mouth out "
          "for this study, and set anatomy.lips: joined where anatomy is given",
          file);
    own_ = model::build_model(anatomy_).model;
  }

  void choose_edges() {
    if (plan_.edges) return;
    double edge = base::rank(comm) == 0 ? meshtools::even_edge(anatomy_.skin) : 0;
    MPI_Bcast(&edge, 1, MPI_DOUBLE, 0, comm);
    plan_.edges = {std::round(15 * edge) / 10, std::round(20 * edge) / 10};
  }

  /// The scene's tissue, or springs that resemble its material.
  scene::Tissue tissue_of(const Variant& variant) const {
    scene::Tissue tissue = anatomy_.scene.tissue;
    if (tissue.material && variant.volume != scene::VolumeTerm::material) {
      tissue.isotropic = tissue.material->deep;
      tissue.material.reset();
    }
    return tissue;
  }

  /// The scene's own model, or one of the same material at another resolution. On rank 0.
  model::Model build(const Variant& variant) const {
    const bool own = variant.volume == scene::VolumeTerm::material || !plan_.scene.tissue.material;
    if (own && variant.edge == 0 && variant.layers == plan_.scene.tissue.layers) return own_;
    model::Anatomy anatomy = anatomy_;
    anatomy.scene.tissue = tissue_of(variant);
    return adapt::coarse_model(anatomy, own_, {variant.edge, variant.layers}).model;
  }

  /// The reference: the most layers, the skin as it is, the scene's volume term.
  void prepare(const std::vector<Variant>& variants) {
    Variant finest = usual_variant(plan_);
    for (const Variant& variant : variants) finest.layers = std::max(finest.layers, variant.layers);
    tell_("the reference", 0, variants.size());
    const Discretization& reference = discretization(finest);
    base::on_root(comm, [&] {
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

  const Discretization& discretization(const Variant& variant) {
    const auto known = known_.find(key_of(variant));
    if (known != known_.end()) return known->second;
    Discretization& made = known_[key_of(variant)];
    base::on_root(comm, [&] {
      made.model = build(variant);
      made.bulk_modulus = plan_.scene.solve.bulk_modulus.value_or(model::default_bulk_modulus(
          tissue_of(variant), plan_.scene.solve, model::effective_modulus(made.model)));
    });
    MPI_Bcast(&made.bulk_modulus, 1, MPI_DOUBLE, 0, comm);
    bring_into_equilibrium(made.model);
    Variant closely = usual_variant(plan_);
    closely.volume = variant.volume;
    closely.accuracy = plan_.reference_accuracy;
    Run run = solve_as(closely, made, patience * plan_.seconds);
    if (run.measurement.converged) made.rest = std::move(run.position);
    return made;
  }

  void bring_into_equilibrium(model::Model& model) const {
    if (const auto reference_state = app::reference_state_of(plan_.scene))
      solve::prestress(comm, model, *reference_state);
    base::on_root(comm, [&] { model::add_tone(anatomy_.scene, model); });
  }

  solve::Settings settings_of(const Variant& variant, double bulk_modulus) const {
    scene::Solve requested = plan_.scene.solve;
    const bool solid = variant.volume == scene::VolumeTerm::material;
    if (!solid) requested.volume = variant.volume;
    requested.bulk_modulus = bulk_modulus;
    requested.accuracy = variant.accuracy;
    requested.load_steps = variant.load_steps;
    return app::settings_of(requested, solid);
  }

  Run solve_as(const Variant& variant, const Discretization& made, double limit) const {
    const base::ScopedOption method("-tao_type", variant.method);
    Run run;
    run.measurement.variant = variant;
    const double begin = base::cpu_seconds();
    base::Interrupt end(comm, limit, false);
    solve::Settings settings = settings_of(variant, made.bulk_modulus);
    settings.interrupt = &end;
    const solve::Summary summary =
        solve::find_repose(comm, made.model, settings, {},
                           [&](const model::StepNumbers&, const model::StepRows& rows) {
                             run.position = base::gather(comm, rows.position);
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

  void add(const Variant& variant) {
    const Discretization& made = discretization(variant);
    Run run = solve_as(variant, made, plan_.seconds);
    base::on_root(comm, [&] {
      Measurement& m = run.measurement;
      m.error = m.skin_rms = m.skin_95 = m.skin_max = unknown;
      if (!run.position.empty()) compare(run, made);
      findings_.measurements.push_back(m);
    });
  }

  void compare(Run& run, const Discretization& made) {
    Measurement& m = run.measurement;
    if (made.rest.size() == run.position.size()) {
      m.error = 0;
      for (size_t i = 0; i < made.rest.size(); ++i)
        m.error = std::max(m.error, (made.rest[i] - run.position[i]).norm());
    }
    std::vector<double> off = skin_->distances(made.model, run.position);
    if (m.variant.study != "solver") {
      findings_.map.variants.push_back(m.variant);
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
  std::map<Key, Discretization> known_;
  std::optional<Skin> skin_;  // on rank 0
  Findings findings_;
};

}  // namespace

Findings measure(const Plan& plan, const Tell& tell) { return Study(plan, tell).run(); }

}  // namespace repose::tradeoff
