/// repose-solve INPUT: from a scene (.yaml) or a model (.h5) to the rest position of the tissue.
///
///     repose-solve meshes/head_jaw_opening.yaml
///     mpirun -n 2 repose-solve meshes/head_jaw_opening.yaml -accuracy 0.01 -output opening
///     repose-solve opening.h5 -tao_type lmvm -tao_monitor
///
/// Writes NAME.h5 and one XDMF file a block for ParaView. Exit status: 0 converged, 1 bad input
/// (nothing written), 2 not converged or folded (result written), 3 internal error.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>

#include "repose/adapt/discretisation.h"
#include "repose/adapt/given_skin.h"
#include "repose/adapt/ladder.h"
#include "repose/adapt/report.h"
#include "repose/base/agreement.h"
#include "repose/base/deal_out.h"
#include "repose/base/interrupt.h"
#include "repose/base/program.h"
#include "repose/discrete/gather.h"
#include "repose/model/build.h"
#include "repose/model/cut.h"
#include "repose/model/places.h"
#include "repose/results/model_file.h"
#include "repose/results/name_lock.h"
#include "repose/results/restart.h"
#include "repose/results/result_file.h"
#include "repose/scene/scene.h"
#include "repose/solve/active_search.h"
#include "repose/solve/prestress.h"
#include "repose/solve/reaction.h"
#include "repose/solve/report.h"
#include "repose/solve/sliding.h"
#include "repose/solve/tearing.h"
#include "repose/surface/read.h"
#include "repose/surface/write.h"

namespace {

using namespace repose;
using base::OptionKind;

const MPI_Comm comm = MPI_COMM_WORLD;

// In the order of scene::Functional and scene::VolumeForm.
const std::vector<std::string> functional_words = {"energy", "force"};
const std::vector<std::string> volume_words = {"none", "paper", "penalty", "exact"};
// In the order of solve::Extent.
const std::vector<std::string> extent_words = {"off", "auto", "on"};

const base::Option active_region_option = {
    "active_region",
    OptionKind::choice,
    "auto",
    "Search only the tissue that feels what moves; auto: where it pays.",
    {},
    "",
    extent_words};

/// What is computed, and how near.
std::vector<base::Option> method_options() {
  return {
      {"output", OptionKind::path, "",
       "Path of the result without ending; default: the input's name here."},
      {"accuracy",
       OptionKind::number,
       "",
       "Stop when the rest position is this near (default 0.1).",
       {1e-12, 100},
       "mm"},
      {"functional", OptionKind::choice, "", "What is minimised.", {}, "", functional_words},
      {"volume",
       OptionKind::choice,
       "",
       "Volume term (force: none or paper).",
       {},
       "",
       volume_words},
      {"lambda",
       OptionKind::number,
       "",
       "Weight of the energy, with volume term paper.",
       {.min = 0, .max = 1, .min_excluded = true}},
      {"bulk_modulus", OptionKind::number, "", "Of the penalty volume term.", {0, 1e9}, "N/mm²"},
      {"load_steps",
       OptionKind::integer,
       "",
       "Equal steps of the bones' motion, or auto.",
       {1, 100000},
       "",
       {"auto"}},
  };
}

/// On which models.
std::vector<base::Option> model_options() {
  return {
      {"profile",
       OptionKind::choice,
       "balanced",
       "preview: a coarse model, 1 mm; balanced: as the scene says; exact: 1e-6 mm, -nested off.",
       {},
       "",
       {"preview", "balanced", "exact"}},
      {"adapt", OptionKind::flag, "",
       "Solve the coarsest model whose skin is within the accuracy: of springs of the scene's own "
       "model, of a solid, which may be refined too, of the continuum."},
      {"discretisation", OptionKind::flag, "",
       "Estimate how far mesh and layers leave the skin from the continuum, by coarser models."},
      {"nested",
       OptionKind::choice,
       "auto",
       "Solve coarser models first and start from their answer; auto: where it pays.",
       {},
       "",
       {"auto", "on", "off"}},
      active_region_option,
  };
}

/// How the run goes on, ends and tells of itself.
std::vector<base::Option> run_options() {
  return {
      {"stability", OptionKind::flag, "",
       "Report the smallest eigenvalue of the energy's Hessian (SLEPc)."},
      {"monitor_mm", OptionKind::flag, "",
       "Print time, evaluations and the estimated distance to go after each iteration."},
      {"time_limit",
       OptionKind::number,
       "",
       "End all searches after this, keep the state and say how far it is.",
       {0, 1e9},
       "s"},
      {"allow_folded", OptionKind::flag, "",
       "Take a rest position with tissue inside out (else exit status 2)."},
      {"dry_run", OptionKind::flag, "", "Build and report the model only."},
      {"restart", OptionKind::path, "",
       "Go on from the last step of this result of the same model."},
      {"checkpoint_interval",
       OptionKind::number,
       "",
       "Seconds between NAME_checkpoint.h5.",
       {0, 1e9},
       "s"},
  };
}

std::vector<base::Option> option_table() {
  std::vector<base::Option> table = method_options();
  for (const auto& more : {model_options(), run_options()})
    table.insert(table.end(), more.begin(), more.end());
  return table;
}

/// The model on rank 0, with what the scene asks of the solver.
struct Job {
  model::Model model;
  scene::Solve wanted;                        // on all ranks
  std::optional<model::Anatomy> anatomy;      // of a scene, on rank 0
  std::optional<solve::Recording> recording;  // of an initial equilibrium, on all ranks
  bool solid = false;                         // the tissue is a solid, on all ranks
  bool initial_equilibrium = false;           // it holds before the bones move, on all ranks
  bool remeshed = false;                      // the skin is not the given one, on all ranks
  std::string building;                       // what the builder has to say, on rank 0
  std::vector<std::vector<int64_t>> held;     // points of each instrument, on rank 0
  std::vector<model::Slider> sliders;         // on rank 0
  std::vector<model::Cut> cuts;               // on rank 0
  std::optional<double> tearing;              // N, on rank 0
};

/// Gives the tissue the stress it had when its surfaces were recorded, where the scene knows of
/// any.
void bring_into_equilibrium(const scene::Scene& scene, Job& job) {
  job.initial_equilibrium = scene.tissue.turgor > 0 || scene.gravity.has_value();
  MPI_Bcast(&job.initial_equilibrium, 1, MPI_C_BOOL, 0, comm);
  if (!job.initial_equilibrium) return;
  job.recording = {scene.tissue.turgor,
                   scene.scan_gravity.value_or(scene.gravity.value_or(Vec3::Zero()))};
  job.building += solve::describe_prestress(solve::prestress(comm, job.model, *job.recording));
}

/// Cuts the tissue as its initial equilibrium left it, so that its tension opens the cut.
void make_incisions(Job& job) {
  base::on_first_rank(comm, [&] {
    for (const model::Cut& cut : job.cuts) {
      const size_t doubled = model::cut_along(cut, job.model).size();
      job.building += solve::describe_cut(cut, static_cast<int64_t>(doubled));
      job.initial_equilibrium = false;
    }
  });
  MPI_Bcast(&job.initial_equilibrium, 1, MPI_C_BOOL, 0, comm);
}

/// Builds the model; where no tissue fits, writes those places of the skin to look at.
model::BuiltModel build(const model::Anatomy& anatomy, const std::filesystem::path& input) {
  try {
    return model::build_model(anatomy);
  } catch (const model::RefusedPlaces& refused) {
    const std::string file = input.stem().string() + "_refused.ply";
    surface::write_ply(file, refused.places());
    base::refuse("{} (these places are in {})", refused.what(), file);
  }
}

Job read_job(const std::filesystem::path& input) {
  Job job;
  scene::Scene scene;
  base::on_first_rank(comm, [&] {
    if (results::is_hdf5(input)) {
      job.model = results::read_model(input);
      return;
    }
    scene = scene::read_scene(input);
    job.anatomy = model::load_anatomy(scene);
    job.remeshed = job.anatomy->given_skin.has_value();
    model::BuiltModel built = build(*job.anatomy, input);
    job.model = std::move(built.model);
    job.held = std::move(built.held);
    job.sliders = std::move(built.sliders);
    job.cuts = std::move(built.cuts);
    job.tearing = scene.tearing;
    job.building = solve::describe_build(built.report);
    job.wanted = scene.solve;
  });
  job.solid = model::is_solid(job.model);
  MPI_Bcast(&job.solid, 1, MPI_C_BOOL, 0, comm);
  MPI_Bcast(&job.remeshed, 1, MPI_C_BOOL, 0, comm);
  bring_into_equilibrium(scene, job);
  make_incisions(job);
  if (!job.wanted.bulk_modulus && base::rank(comm) == 0)
    job.wanted.bulk_modulus = model::default_bulk_modulus(scene.tissue, job.wanted, job.model);
  double bulk_modulus = job.wanted.bulk_modulus.value_or(0);
  MPI_Bcast(&bulk_modulus, 1, MPI_DOUBLE, 0, comm);
  job.wanted.bulk_modulus.reset();
  static_assert(std::is_trivially_copyable_v<scene::Solve>);
  MPI_Bcast(&job.wanted, sizeof job.wanted, MPI_BYTE, 0, comm);
  job.wanted.bulk_modulus = bulk_modulus;
  return job;
}

template <class Choice, class Target>
void choose(const base::Options& options, const char* name, const std::vector<std::string>& words,
            Target& value) {
  if (!options.has(name)) return;
  const auto place = std::find(words.begin(), words.end(), options.text(name));
  value = static_cast<Choice>(place - words.begin());
}

/// mm that a profile asks for, if it does.
std::optional<double> accuracy_of(const std::string& profile) {
  if (profile == "preview") return 1.0;
  if (profile == "exact") return 1e-6;
  return {};
}

/// The command line beats the scene, and an option of its own the profile.
void override_by(const base::Options& options, scene::Solve& wanted) {
  choose<scene::Functional>(options, "functional", functional_words, wanted.functional);
  choose<scene::VolumeForm>(options, "volume", volume_words, wanted.volume);
  wanted.accuracy = accuracy_of(options.text("profile")).value_or(wanted.accuracy);
  if (options.has("accuracy")) wanted.accuracy = options.number("accuracy");
  if (options.has("lambda")) wanted.lambda = options.number("lambda");
  if (options.has("bulk_modulus")) wanted.bulk_modulus = options.number("bulk_modulus");
  if (options.has("load_steps"))
    wanted.load_steps =
        options.text("load_steps") == "auto" ? 0 : static_cast<int>(options.integer("load_steps"));
}

/// A solid's energy is its material's: nothing of how springs are minimised applies to it.
void require_energy(const scene::Solve& wanted) {
  if (wanted.functional == scene::Functional::force)
    base::refuse("functional force is of tissue.springs, and the tissue is a solid; choose energy");
  if (wanted.volume)
    base::refuse(
        "solve.volume is of tissue.springs, and the tissue is a solid, whose Poisson's ratio says "
        "how it keeps its volume (tissue.material.poisson); remove it");
}

solve::Settings settings_of(const scene::Solve& wanted, bool solid) {
  using scene::VolumeForm;
  solve::Settings settings;
  settings.force = wanted.functional == scene::Functional::force;
  const VolumeForm form =
      wanted.volume.value_or(settings.force ? VolumeForm::none : VolumeForm::penalty);
  settings.volume = volume_words[static_cast<size_t>(form)];
  if (settings.force && form != VolumeForm::none && form != VolumeForm::paper)
    base::refuse(
        "functional force takes volume none or paper, not {}: a penalty or a constraint belongs to "
        "the energy; choose -functional energy or another -volume",
        settings.volume);
  settings.path.accuracy = wanted.accuracy;
  settings.path.load_steps = wanted.load_steps;
  if (solid) {
    require_energy(wanted);
    settings.volume = "material";
    settings.weights = mechanics::solid_weights;
    return settings;
  }
  settings.exact_volume = form == VolumeForm::exact;
  if (form == VolumeForm::penalty || form == VolumeForm::exact)
    settings.weights = {1, mechanics::VolumeTerm::penalty, *wanted.bulk_modulus};
  if (form == VolumeForm::paper) {
    settings.lambda = wanted.lambda;
    settings.weights = {wanted.lambda, mechanics::VolumeTerm::paper, 1 - wanted.lambda};
  }
  return settings;
}

/// The part of the tissue that is searched; called when all else is settled.
void choose_extent(const base::Options& options, solve::Settings& settings) {
  settings.extent = solve::Extent::automatic;
  choose<solve::Extent>(options, "active_region", extent_words, settings.extent);
  const std::string obstacle = solve::obstacle_to_region(settings);
  if (settings.extent == solve::Extent::region && !obstacle.empty())
    base::refuse("-active_region on: {}; leave the option out", obstacle);
}

void say(const std::string& text) {
  if (base::rank(comm) == 0) std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

/// What coarser models gave.
struct Coarser {
  std::string told;                            // on rank 0
  std::optional<adapt::Ladder> compared;       // with the scene's own model, where asked for
  std::optional<double> discretisation_error;  // mm, of the model that was chosen, if one was
};

/// Writes every step to the result, and from time to time what was reached to a checkpoint.
class Writer {
 public:
  /// `unsettled`: why not even a rest position at load 1 is the end, or empty.
  Writer(const std::filesystem::path& name, const model::Model& model, const Coarser& coarser,
         double interval, std::string unsettled)
      : name_(name),
        model_(model),
        coarser_(coarser),
        unsettled_(std::move(unsettled)),
        file_(comm, name, model),
        interval_(interval) {}

  void operator()(model::StepNumbers numbers, model::StepRows rows) {
    if (numbers.load == 1 && coarser_.discretisation_error)
      numbers.discretisation_error = *coarser_.discretisation_error;
    if (coarser_.compared) compare(numbers, rows);
    if (numbers.load == 1 && !unsettled_.empty()) {
      numbers.converged = false;
      numbers.reason += "; " + unsettled_;
    }
    file_.append(numbers, rows);
    last_numbers_ = numbers;
    last_rows_.position = rows.position;
    last_rows_.pressure = rows.pressure;
    last_rows_.volume_ratio = rows.volume_ratio;
    if (!makes_checkpoints() || !numbers.converged) return;
    reached_ = {numbers, rows};
    saved_ = false;
    if (due()) write_checkpoint(nullptr);
  }
  /// At an iteration of a search.
  void look_in(double load, const solve::Look& look) {
    const bool news = !saved_ || (look && load == 1);
    if (reached_ && news && due()) write_checkpoint(load == 1 ? look : nullptr);
  }
  void commit() { file_.commit(); }
  bool compares() const { return coarser_.compared.has_value(); }
  /// How far the mesh and the layers leave the skin from the continuum, on rank 0.
  const std::string& comparison() const { return comparison_; }
  bool makes_checkpoints() const { return interval_ > 0; }
  /// [N] and [prisms] of the last step, on rank 0. Collective.
  std::vector<Vec3> positions() const { return discrete::gather_points(comm, last_rows_.position); }
  std::vector<double> volume_ratios() const {
    return discrete::gather(comm, last_rows_.volume_ratio.data(), last_rows_.volume_ratio.size());
  }
  /// What the tissue does to the instruments in the last step, on rank 0.
  std::string reactions(const std::vector<std::vector<int64_t>>& held) const {
    const std::vector<Vec3> forces =
        solve::reactions(comm, model_, held, last_numbers_, last_rows_);
    return forces.empty() ? "" : solve::describe_reactions(held, forces);
  }
  const std::string& unsettled() const { return unsettled_; }

 private:
  void compare(model::StepNumbers& numbers, model::StepRows& rows) {
    rows.discretisation_error.assign(rows.position.size(), 0.0);
    if (numbers.load < 1) return;
    const std::vector<Vec3> position = discrete::gather_points(comm, rows.position);
    std::vector<Vec3> at_point(position.size());
    base::on_first_rank(comm, [&] {
      const auto found = adapt::discretisation_of(model_, position, *coarser_.compared);
      numbers.discretisation_error = found.largest;
      comparison_ = adapt::describe_discretisation(found);
      for (size_t i = 0; i < at_point.size(); ++i) at_point[i].x() = found.at_point[i];
    });
    const std::vector<Vec3> mine = base::deal_out(comm, at_point);
    for (size_t i = 0; i < mine.size(); ++i) rows.discretisation_error[i] = mine[i].x();
  }

  struct Step {
    model::StepNumbers numbers;
    model::StepRows rows;
  };
  bool due() const {
    int due = MPI_Wtime() - last_ > interval_;
    MPI_Bcast(&due, 1, MPI_INT, 0, comm);
    return due != 0;
  }
  /// The last rest position reached and, of a search at load 1, the state it is at: with both a
  /// run can go on from there or, should that lead astray, along the path.
  void write_checkpoint(const solve::Look& look) {
    results::ResultFile file(comm, name_.string() + "_checkpoint", model_,
                             results::Kind::checkpoint);
    file.append(reached_->numbers, reached_->rows);
    if (look && reached_->numbers.load < 1)
      look([&](const auto& numbers, const auto& rows) { file.append(numbers, rows); });
    file.commit();
    saved_ = true;
    last_ = MPI_Wtime();
  }

  std::filesystem::path name_;
  const model::Model& model_;
  const Coarser& coarser_;
  std::string comparison_;
  std::string unsettled_;
  results::ResultFile file_;
  model::StepNumbers last_numbers_;
  model::StepRows last_rows_;    // what reactions and those above need of them
  std::optional<Step> reached_;  // where checkpoints are made: the last rest position, …
  bool saved_ = false;           // … and whether a checkpoint has it
  double interval_, last_ = MPI_Wtime();
};

/// Finds the rest position of the job's model, which rank 0 lets go of where only the search needs
/// it: of a large model it is a fifth of the memory.
solve::Summary search(Job& job, solve::Settings settings, const solve::Start& start,
                      base::Stages& stages, Writer& writer) {
  if (writer.makes_checkpoints())
    settings.under_way = [&](double load, const auto& look) { writer.look_in(load, look); };
  const bool needed = writer.makes_checkpoints() || writer.compares() || !job.held.empty();
  solve::Summary summary =
      needed ? solve::find_repose(comm, job.model, settings, start, stages, std::ref(writer))
             : solve::find_repose(comm, std::move(job.model), settings, start, stages,
                                  std::ref(writer));
  if (summary.path.complete() && !writer.unsettled().empty()) {
    summary.path.last.converged = false;
    summary.last.reason += "; " + writer.unsettled();
  }
  return summary;
}

/// Writes the displacement of the given skin, in the place of which another was solved, to
/// NAME_given_skin.vtp. Collective.
std::string write_given_skin(const Job& job, const std::string& name, const Writer& writer) {
  if (!job.remeshed || !job.cuts.empty()) return "";
  const std::vector<Vec3> position = writer.positions();
  const std::string file = name + "_given_skin.vtp";
  base::on_first_rank(comm, [&] {
    const model::Model model = results::read_model(name + ".h5");
    std::vector<Vec3> displacement(position.size());
    for (size_t i = 0; i < position.size(); ++i)
      displacement[i] = position[i] - model.points.position[i];
    const surface::Surface& given = *job.anatomy->given_skin;
    surface::write_surface(file, given, adapt::displacement_of_given(given, model, displacement));
  });
  return fmt::format("  {:<22} {}: its vertices, with displacement\n", "given skin", file);
}

/// What is said of tissue that is inside out at the end. Collective.
std::string describe_folds(const model::StepNumbers& last, const std::string& name,
                           const Writer& writer) {
  if (last.inverted_prisms == 0) return "";
  const std::vector<double> ratios = writer.volume_ratios();
  std::string text;
  base::on_first_rank(
      comm, [&] { text = solve::describe_folds(results::read_model(name + ".h5"), ratios); });
  return text;
}

/// Path of the result without ending; never that of the input, which is read first: what is wrong
/// with it is to be said first.
std::string result_name(const base::Options& options, const std::filesystem::path& input) {
  const std::string name = options.has("output") ? options.text("output") : input.stem().string();
  std::error_code missing;
  if (!std::filesystem::equivalent(name + ".h5", input, missing) || missing) return name;
  read_job(input);
  base::refuse("{}: the result would replace the input; give another -output", input.string());
}

/// Sliding points find their places and springs tear, in rounds of searches.
struct Rounds {
  solve::Sliding sliding;
  solve::Tearing tearing;
  /// Why the result is not to be trusted as an end, or nothing.
  std::string unsettled() const {
    const std::string who =
        sliding.stopped || tearing.stopped ? "a signal or the time limit: " : "";
    if (!sliding.settled) return who + "points that slide have not found their places";
    return tearing.settled ? "" : who + "more may tear";
  }
};

/// The search begins with a state that the rounds left.
void start_from(double load, const std::vector<Vec3>& position, solve::Settings& settings,
                results::Restart& restart) {
  restart = {load, position, false};
  settings.path.start_load = load;
  if (load > 0) settings.initial_equilibrium = false;
}

Rounds go_through_rounds(Job& job, solve::Settings& settings, results::Restart& restart,
                         base::Stages& stages) {
  Rounds rounds;
  rounds.sliding = solve::slide(comm, job.model, job.sliders, settings, restart.position);
  if (rounds.sliding.rounds > 0) stages.end("slide");
  if (rounds.sliding.stopped)
    start_from(rounds.sliding.load, rounds.sliding.position, settings, restart);
  rounds.tearing = solve::tear(comm, job.model, job.tearing, settings, restart.position);
  if (rounds.tearing.rounds > 0) stages.end("tear");
  if (rounds.tearing.torn) start_from(1, rounds.tearing.position, settings, restart);
  return rounds;
}

/// Why coarser models cannot be solved first, or nothing.
std::string obstacle_to_nesting(const Job& job, const solve::Settings& settings, bool restarted) {
  if (!job.anatomy) return "the input is a model, which does not tell what it was made from";
  if (restarted) return "the run is restarted";
  if (settings.path.load_steps > 0) return "load_steps are asked for";
  if (settings.force) return "the functional is force";
  if (settings.exact_volume) return "the volume term is exact";
  if (!job.cuts.empty()) return "the scene has incisions";
  if (!job.sliders.empty()) return "an instrument slides";
  if (job.tearing) return "the tissue may tear";
  return "";
}

/// What the options say of coarser models.
struct Wish {
  bool preview, adapt, nested;
  bool compare;     // to tell how far the scene's own model is from the continuum
  bool insisted;    // not to be passed over where it cannot be
  std::string who;  // the option that asks for it
};

Wish wish_of(const base::Options& options) {
  const std::string profile = options.text("profile");
  const bool exact = profile == "exact" && !options.has("nested");
  const std::string nested = exact ? "off" : options.text("nested");
  const bool adapt = options.flag("adapt");
  if (adapt && nested == "off")
    base::refuse("-adapt solves coarser models; leave -nested off or -profile exact out");
  const bool compare = options.flag("discretisation");
  if (compare && (adapt || nested == "off"))
    base::refuse(
        "-discretisation solves coarser models to compare the scene's own with; leave -adapt, "
        "-nested off and -profile exact out");
  return {profile == "preview",
          adapt,
          nested != "off",
          compare,
          adapt || compare || nested == "on",
          adapt     ? "-adapt"
          : compare ? "-discretisation"
                    : "-nested on"};
}

/// The resolutions that are solved before the scene's own, on rank 0.
std::vector<adapt::Resolution> plan_rungs(const Wish& wish, const Job& job,
                                          const solve::Settings& settings, bool restarted) {
  constexpr int64_t preview_columns = 4000;
  if (!wish.nested) return {};
  const std::string obstacle = obstacle_to_nesting(job, settings, restarted);
  if (!obstacle.empty()) {
    if (wish.insisted) base::refuse("{}: {}; leave the option out", wish.who, obstacle);
    return {};
  }
  const auto columns = static_cast<int64_t>(job.anatomy->skin.points.size());
  const bool leads = !job.solid && adapt::guides_pay(*job.anatomy, job.model);
  if (!wish.insisted && !wish.preview && !leads) return {};
  if (wish.compare) return adapt::halved_resolutions(*job.anatomy);
  if (wish.adapt && job.solid) return adapt::convergence_of(*job.anatomy, job.model).rungs;
  if (wish.adapt) return adapt::compared_rungs(*job.anatomy, columns);
  if (wish.preview) return adapt::compared_rungs(*job.anatomy, preview_columns);
  std::vector<adapt::Resolution> rungs = adapt::guiding_rungs(*job.anatomy);
  if (wish.insisted && rungs.empty())
    base::refuse("{}: the skin has only {} vertices; leave the option out", wish.who, columns);
  return rungs;
}

/// Solves coarser models first where that pays; `start` is then the guess they lead to, for the
/// scene's own model or for the coarse one that takes its place in the job.
Coarser solve_coarser(const base::Options& options, Job& job, solve::Settings& settings,
                      solve::Start& start) {
  const Wish wish = wish_of(options);
  adapt::Climb climb{{}, job.recording, settings};
  base::on_first_rank(
      comm, [&] { climb.rungs = plan_rungs(wish, job, settings, options.has("restart")); });
  auto rungs = static_cast<int>(climb.rungs.size());
  MPI_Bcast(&rungs, 1, MPI_INT, 0, comm);
  if (rungs == 0) return {};
  climb.rungs.resize(rungs);
  if (wish.adapt || wish.preview) climb.enough = settings.path.accuracy;
  const model::Anatomy none;
  adapt::Ladder ladder = adapt::climb(comm, job.anatomy ? *job.anatomy : none, job.model, climb);
  Coarser coarser{adapt::describe_ladder(ladder), {}, {}};
  const bool converging = wish.adapt && job.solid;
  if (ladder.near_enough || ((wish.preview || converging) && ladder.rungs.size() > 1)) {
    coarser.discretisation_error = ladder.rungs.back().discretisation_error;
    if (job.anatomy)
      coarser.told += converging ? adapt::describe_convergence(
                                       ladder, settings.path.accuracy,
                                       adapt::convergence_of(*job.anatomy, job.model).limit)
                                 : adapt::describe_choice(ladder, settings.path.accuracy);
    settings.path.accuracy = ladder.last_settings.path.accuracy;
    settings.weights = ladder.last_settings.weights;
    job.model = std::move(ladder.last.model);
    job.held = std::move(ladder.last.held);
    start = {base::deal_out(comm, ladder.last_position), true};
  } else if (!ladder.rungs.empty()) {
    start = {base::deal_out(comm, ladder.position), true};
  }
  if (wish.compare && !ladder.rungs.empty()) coarser.compared = std::move(ladder);
  return coarser;
}

/// What the options ask of the searches.
solve::Settings settings_of(const base::Options& options, const Job& job) {
  solve::Settings settings = settings_of(job.wanted, job.solid);
  settings.stability = options.flag("stability");
  settings.monitor = options.flag("monitor_mm");
  settings.initial_equilibrium = job.initial_equilibrium;
  return settings;
}

/// From a job that is built to its result.
base::Exit solve_job(const base::Options& options, Job& job, solve::Settings settings,
                     const std::string& name, base::Stages& stages) {
  const double unlimited = std::numeric_limits<double>::infinity();
  base::Interrupt interrupt(
      comm, options.has("time_limit") ? options.number("time_limit") : unlimited, true);
  settings.interrupt = &interrupt;
  results::Restart restart;
  if (options.has("restart")) {
    restart = results::read_restart(comm, options.text("restart"), job.model);
    settings.path.start_load = restart.load;
  }
  choose_extent(options, settings);
  const Rounds rounds = go_through_rounds(job, settings, restart, stages);
  solve::Start start{restart.position, restart.guess};
  const Coarser coarser = solve_coarser(options, job, settings, start);
  if (start.guess && !restart.guess) stages.end("coarser models");
  Writer writer(name, job.model, coarser,
                options.has("checkpoint_interval") ? options.number("checkpoint_interval") : 0,
                rounds.unsettled());
  const solve::Summary summary = search(job, settings, start, stages, writer);
  writer.commit();
  const bool folded = summary.last.inverted_prisms > 0 && !options.flag("allow_folded");
  say(folded ? describe_folds(summary.last, name, writer) : "");
  const std::string given = write_given_skin(job, name, writer);
  stages.end("write");
  say(solve::describe_run(summary, settings, base::size(comm), stages));
  say(coarser.told + writer.comparison() + solve::describe_sliding(rounds.sliding) +
      solve::describe_tearing(rounds.tearing));
  say(writer.reactions(job.held));
  say(fmt::format("  {:<22} {}.h5, {}_*.xdmf (ParaView)\n", "result", name, name));
  say(given);
  return summary.path.complete() && !folded ? base::Exit::done : base::Exit::not_converged;
}

base::Exit run(const base::Options& options) {
  base::Stages stages(comm);
  const std::filesystem::path input = options.arguments()[0];
  const bool dry = options.flag("dry_run");
  const std::string name = dry ? "" : result_name(options, input);
  std::optional<results::NameLock> lock;
  base::on_first_rank(comm, [&] {
    if (!dry) lock.emplace(name);
  });
  Job job = read_job(input);
  override_by(options, job.wanted);
  solve::Settings settings = settings_of(options, job);
  stages.end("build");
  if (base::rank(comm) == 0) say(job.building + solve::describe_model(job.model));
  if (!dry) return solve_job(options, job, std::move(settings), name, stages);
  say(solve::describe_stages(stages));
  return base::Exit::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv,
                        "Finds the rest position of facial soft tissue after its bones moved.",
                        {{"INPUT", "scene (.yaml) or model (.h5)"}}, option_table());
  return base::run_program(options, [&] { return run(options); });
}
