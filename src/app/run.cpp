#include "repose/app/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>

#include "answer.h"
#include "given_skin_file.h"
#include "phase.h"
#include "plan_pieces.h"
#include "report.h"
#include "repose/adapt/discretization.h"
#include "repose/base/agreement.h"
#include "repose/base/interrupt.h"
#include "repose/base/whole_file.h"
#include "repose/discrete/natural_rows.h"
#include "repose/results/additions.h"
#include "repose/results/name_lock.h"
#include "repose/results/restart.h"
#include "repose/results/result_file.h"
#include "repose/results/run_files.h"
#include "repose/scene/landmarks.h"
#include "repose/solve/supported.h"
#include "repose/surface/write.h"
#include "self_contact.h"
#include "sensitivity.h"
#include "strategy.h"
#include "verify_path.h"
#include "writer.h"

namespace repose::app {

namespace {

/// On rank 0.
void add_summary(const std::filesystem::path& file, const std::string& text) {
  const std::string refused = results::add_summary(file, text);
  if (!refused.empty()) fmt::print(stderr, "warning: {}\n", refused);
}

const MPI_Comm comm = MPI_COMM_WORLD;

void print(const std::string& text) {
  if (base::rank(comm) == 0) std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

/// Path of the result without ending; never that of the input, which is read first: what is wrong
/// with it is to be said first.
std::string result_name(const base::Options& options, const std::filesystem::path& input) {
  std::string name = options.has("output") ? options.text("output") : input.stem().string();
  std::error_code missing;
  if (!std::filesystem::equivalent(name + ".h5", input, missing) || missing) return name;
  read_job(comm, input);
  base::refuse("{}: the result would replace the input; give another -output", input.string());
}

/// Why a result is not to be trusted as an end, or nothing.
std::string unsettled(const solve::Tearing& tearing) {
  if (tearing.settled) return "";
  return tearing.stopped ? "a signal or the time limit: more may tear" : "more may tear";
}

/// While it lives, a signal makes what is written so far the result at once: the ranks may be
/// killed before their search ends.
class Saving {
 public:
  Saving(base::Interrupt& interrupt, Writer& writer, const std::string& name)
      : interrupt_(interrupt) {
    if (base::rank(comm) > 0) return;
    interrupt_.on_signal([&writer, name] {
      if (writer.save()) print(describe_saved(name));
    });
  }
  ~Saving() { interrupt_.on_signal({}); }
  Saving(Saving&&) = delete;

 private:
  base::Interrupt& interrupt_;
};

/// One run of a job by a strategy, under one deadline.
class Run {
 public:
  Run(const base::Options& options, Job& job, Strategy strategy, std::string name,
      base::Stages& stages)
      : options_(options),
        job_(job),
        strategy_(std::move(strategy)),
        name_(std::move(name)),
        stages_(stages),
        interrupt_(comm, number("time_limit", std::numeric_limits<double>::infinity()), true),
        folds_allowed_(options.flag("allow_folded")) {
    strategy_.settings.interrupt = &interrupt_;
    strategy_.settings.stages = &stages_;
  }

  /// Begins where another run left off. Returns how that ended, if nothing is left to do.
  std::optional<base::Exit> restart(const std::filesystem::path& file);
  base::Exit solve();

 private:
  double number(const char* option, double otherwise) const {
    return options_.has(option) ? options_.number(option) : otherwise;
  }
  bool is_done(const model::StepNumbers& end) const;
  void copy_result(const std::filesystem::path& file) const;
  solve::Tearing tear();
  Coarser solve_coarser();
  solve::Summary search(Writer& writer);
  std::optional<PathCheck> verify(const solve::Summary& summary, const Writer& writer);
  std::string describe_sensitivity(const solve::Summary& summary, const Writer& writer);

  const discrete::Part& part() const { return job_.local_model.part; }

  const base::Options& options_;
  Job& job_;
  Strategy strategy_;
  std::string name_;
  base::Stages& stages_;
  base::Interrupt interrupt_;
  bool folds_allowed_;
  solve::Start start_;
  std::filesystem::path earlier_;  // the result it resumes from, …
  int64_t kept_ = 0;               // … and of its steps how many
};

/// Returns whether the finished result satisfies all options.
bool Run::is_done(const model::StepNumbers& end) const {
  const solve::Settings& settings = strategy_.settings;
  const mechanics::Weights& weights = settings.weights;
  const bool penalty = end.volume == model::VolumeTerm::penalty;
  const auto equal = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  return end.displacement_error >= 0 && end.displacement_error <= settings.path.accuracy &&
         end.functional == settings.functional && end.volume == weights.volume &&
         equal(end.lambda, weights.elastic) &&
         (!penalty || equal(end.bulk_modulus, weights.volume_weight)) && !settings.stability &&
         !strategy_.sensitivity && !strategy_.tangents.requested() && !strategy_.tears;
}

/// Makes a finished result that of this run's name, unless it is. Collective.
void Run::copy_result(const std::filesystem::path& file) const {
  bool same = false;
  base::on_root(comm, [&] {
    std::ifstream one(file, std::ios::binary), other(name_ + ".h5", std::ios::binary);
    using Bytes = std::istreambuf_iterator<char>;
    same = other && std::equal(Bytes(one), Bytes(), Bytes(other), Bytes());
  });
  base::broadcast(comm, same);
  if (same) return;
  results::ResultFile copy(comm, name_, job_.local_model.global_metadata,
                           discrete::NaturalRows::of_model(comm, job_.local_model));
  copy.keep(file, results::step_count(file));
  copy.commit();
  base::on_root(comm, [&] { results::copy_summary(file, name_ + ".h5"); });
}

std::optional<base::Exit> Run::restart(const std::filesystem::path& file) {
  const results::Restart from =
      results::read_restart(comm, file, discrete::gather_model(comm, job_.local_model));
  start_ = {from.position, from.guess, false, from.pressure};
  strategy_.settings.path.start_load = from.load;
  earlier_ = file;
  kept_ = strategy_.tears ? 0 : from.kept;
  bool done = false, folded = false;
  base::on_root(comm, [&] {
    if (!from.differing.empty())
      print(describe_warnings({fmt::format(
          "{} is of another model or plan: its {} differs; the search begins at its state, and may "
          "find another rest position than without -restart",
          file.string(), from.differing)}));
    if (!from.end || !is_done(*from.end)) return;
    done = true;
    folded = from.end->inverted_prisms > 0 && !folds_allowed_;
    print(describe_finished(file.string(), *from.end, strategy_.settings.path.accuracy, folded));
  });
  base::broadcast(comm, done, folded);
  if (!done) return {};
  copy_result(file);
  const SolvedSkin skin(comm, job_);
  print(write_given_skin(comm, job_, name_, skin, skin.points_at(start_.position)));
  return folded ? base::Exit::not_converged : base::Exit::done;
}

/// Springs tear, in rounds of searches; the run then begins with the state that these left.
solve::Tearing Run::tear() {
  if (!strategy_.tears) return {};
  model::Model whole = discrete::gather_model(comm, job_.local_model);
  solve::Tearing tearing =
      solve::tear(comm, whole, job_.tearing, strategy_.settings, start_.position);
  if (tearing.rounds > 0) stages_.end("tear");
  if (!tearing.torn) return tearing;
  job_.local_model = discrete::build_local_from_root(comm, std::move(whole));
  start_ = {tearing.position, false};
  strategy_.settings.path.start_load = 1;
  strategy_.settings.initial_equilibrium = false;
  return tearing;
}

/// Solves the strategy's coarser models; their answer is then the guess for the scene's own model
/// or for the coarse one that takes its place in the job.
Coarser Run::solve_coarser() {
  if (strategy_.coarse == Strategy::Coarse::none) return {};
  solve::Settings& settings = strategy_.settings;
  const bool compare = strategy_.coarse == Strategy::Coarse::compare;
  const adapt::SequencePlan requested{strategy_.resolutions, job_.reference_state, settings,
                                      compare ? 0 : settings.path.accuracy};
  const model::Anatomy none;
  adapt::GridSequence sequence =
      adapt::solve_sequence(comm, job_.anatomy ? *job_.anatomy : none,
                            discrete::gather_model(comm, job_.local_model), requested);
  Coarser coarser{describe_sequence(sequence), {}, {}};
  const bool converging = !compare && !strategy_.preview && job_.local_model.part.solid;
  const bool last = (strategy_.preview || converging) && sequence.levels.size() > 1;
  if (sequence.near_enough || last) {
    coarser.discretization_error = sequence.levels.back().discretization_error;
    coarser.misses_continuum = converging && !sequence.near_enough;
    coarser.report +=
        describe_choice(sequence, settings.path.accuracy, converging ? &strategy_.limit : nullptr);
    settings.path.accuracy = sequence.last_settings.path.accuracy;
    settings.weights = sequence.last_settings.weights;
    job_.local_model = discrete::build_local_from_root(comm, std::move(sequence.last.model));
    job_.held = std::move(sequence.last.held);
    start_ = {base::scatter(comm, sequence.last_position), true};
  } else if (!sequence.levels.empty()) {
    start_ = {base::scatter(comm, sequence.position), true};
  }
  stages_.end("coarser models");
  if (compare && !sequence.levels.empty()) coarser.compared = std::move(sequence);
  return coarser;
}

/// Finds the rest position of the job's model.
solve::Summary Run::search(Writer& writer) {
  solve::Settings settings = strategy_.settings;
  settings.derivatives = strategy_.tangents;
  settings.on_iterate = [&](double load, const auto& snapshot) {
    writer.on_iterate(load, snapshot);
  };
  solve::Summary summary =
      solve::RestSolver(comm, part(), settings).find(settings, start_, std::ref(writer));
  if (summary.path.complete() && !writer.unsettled().empty()) {
    summary.path.last.converged = false;
    summary.last.reason += "; " + writer.unsettled();
  }
  return summary;
}

/// Solves what came to rest again, in twice the load steps, where that is requested. Collective.
std::optional<PathCheck> Run::verify(const solve::Summary& summary, const Writer& writer) {
  if (!strategy_.verifies_path || !summary.path.complete()) return {};
  solve::Settings settings = strategy_.settings;
  settings.activity = "verifying the path: ";
  PathCheck check = verify_path(comm, part(), settings, summary, writer.slab());
  stages_.end("verify path");
  return check;
}

/// Describes the change of the result under varied assumptions. Collective.
std::string Run::describe_sensitivity(const solve::Summary& summary, const Writer& writer) {
  if (!strategy_.sensitivity || !summary.path.complete()) return "";
  const solve::RestState rest{writer.positions(), writer.contact_pressures()};
  Phase phase(comm, "estimating sensitivities");
  const auto found = sensitivities(comm, job_, strategy_.settings.weights, rest,
                                   [&](double done) { phase.at(done); });
  stages_.end("sensitivity");
  return describe_sensitivities(found);
}

base::Exit Run::solve() {
  const solve::Tearing tearing = tear();
  const Coarser coarser = solve_coarser();
  Writer writer(comm, name_, job_, coarser, number("checkpoint_interval", 0), unsettled(tearing));
  if (kept_ > 0) writer.keep(earlier_, kept_);
  const Saving saving(interrupt_, writer, name_);
  const SolvedSkin skin(comm, job_);
  const solve::Summary summary = search(writer);
  writer.commit();
  const bool folded = summary.last.inverted_prisms > 0 && !folds_allowed_;
  const std::string folds = describe_folds(comm, part(), folded ? summary.last.inverted_prisms : 0,
                                           writer.volume_ratio());
  const std::vector<Vec3> now = skin.points_at(writer.slab());
  const std::string given = write_given_skin(comm, job_, name_, skin, now);
  stages_.end("write");
  const std::optional<PathCheck> path = verify(summary, writer);
  const std::string sensitivity = describe_sensitivity(summary, writer);
  std::string answer, touching;
  base::on_root(comm, [&] {
    answer = describe_answer(job_, skin, now, summary, writer.discretization_error());
    touching = describe_touching(job_, skin, now, summary);
  });
  const std::string text = answer + folds + describe_failure(job_, summary) +
                           describe_run(summary, strategy_.settings, base::size(comm), stages_) +
                           coarser.report + writer.comparison() + sensitivity +
                           describe_tearing(tearing) + describe_tangents(writer.point_fields()) +
                           (path ? describe_path(*path) : "") + writer.reactions() + touching +
                           report_row("result", "{}.h5, {}_*.xdmf (ParaView)", name_, name_) +
                           given;
  print(text);
  base::on_root(comm, [&] { add_summary(name_ + ".h5", text); });
  const bool holds =
      summary.path.complete() && !folded && !coarser.misses_continuum && (!path || path->holds());
  return holds ? base::Exit::done : base::Exit::not_converged;
}

/// The points of incisions, named so that those of each sort along it.
std::map<std::string, Vec3> incision_points(const std::vector<scene::Incision>& incisions) {
  std::map<std::string, Vec3> points;
  for (const scene::Incision& incision : incisions)
    for (size_t i = 0; i < incision.path.size(); ++i)
      points[fmt::format("{} {:04}", incision.name, i + 1)] = incision.path[i];
  return points;
}

/// Writes the skin that a job solves, with its border, to NAME_solved_skin.ply, and where it is cut
/// to NAME_incisions.mrk.json. Returns rows of the report, on rank 0. Collective.
std::string write_solved_skin(const Job& job, const std::string& name) {
  std::string rows;
  base::on_root(comm, [&] {
    if (!job.anatomy) base::refuse("-output: a model file has no skin to write with -dry_run");
    const std::string skin = name + "_solved_skin.ply", cuts = name + "_incisions.mrk.json";
    surface::write_surface(skin, job.anatomy->skin);
    rows = report_row("solved skin", skin);
    if (job.anatomy->scene.incisions.empty()) return;
    base::write_whole_file(cuts,
                           scene::markups_text(incision_points(job.anatomy->scene.incisions)));
    rows += report_row("its incisions", cuts);
  });
  return rows;
}

/// Reads and builds the job, chooses its strategy and prints both. Collective.
std::pair<Job, Strategy> prepare(const base::Options& options, const std::filesystem::path& input,
                                 base::Stages& stages) {
  Phase building(comm, "building the model");
  Job job = read_job(comm, input, [&](double done) { building.at(done); });
  Strategy strategy = make_strategy(comm, options, job);
  building.end();
  stages.end("build");
  if (base::rank(comm) == 0)
    print(job.building + describe_model(job.local_model.counts) + describe_warnings(job) +
          strategy.explanation);
  return {std::move(job), std::move(strategy)};
}

/// Returns a message with the name of the input, unless it has that of the file or option at fault:
/// messages about a model or a state lack it.
std::string name_input(const std::filesystem::path& input, const std::string& message) {
  const bool named = message.find(input.filename().string()) != std::string::npos;
  const bool of_another = message.substr(0, message.find(' ')).ends_with(':');
  const bool of_options = message.starts_with('-') || message.starts_with("PETSc");
  if (named || of_another || of_options) return message;
  return fmt::format("{}: {}", input.string(), message);
}

}  // namespace

base::Exit run(const base::Options& options) {
  solve::require_supported_options();
  const std::filesystem::path input = options.arguments()[0];
  const bool dry = options.flag("dry_run");
  try {
    base::Stages stages(comm);
    const std::string name = dry ? "" : result_name(options, input);
    std::optional<results::NameLock> lock;
    base::on_root(comm, [&] {
      if (!dry) lock.emplace(name);
    });
    auto [job, strategy] = prepare(options, input, stages);
    if (dry) {
      if (options.has("output")) print(write_solved_skin(job, options.text("output")));
      print(describe_stages(stages));
      return base::Exit::done;
    }
    Run run(options, job, std::move(strategy), name, stages);
    if (options.has("restart"))
      if (const auto ended = run.restart(options.text("restart"))) return *ended;
    return run.solve();
  } catch (const base::InputError& error) {
    throw base::InputError(name_input(input, error.what()));
  }
}

}  // namespace repose::app
