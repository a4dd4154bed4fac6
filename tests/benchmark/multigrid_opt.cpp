/// Nonlinear multigrid in its optimisation form (MG/OPT: Nash 2000, Optimization Methods and
/// Software 14; Gratton, Sartenaer & Toint 2008, SIAM J. Optim. 19) against the default and against
/// L-BFGS, all from the answer of a coarser model; docs/measurements/nonlinear_multigrid.md, which
/// tests/benchmark/multigrid_opt.py fills:
///     benchmark_multigrid_opt SCENE.yaml [-methods default,lbfgs,cycles,…] [-coarsening 3]
///                             [-smoothing 10] [-switch 0.05] [-accuracy 0.01]
/// A race ends at the first evaluated state that is as near to the rest position as asked for,
/// which is known from the default. One line of JSON for the start and one for each method. Serial.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "repose/adapt/ladder.h"
#include "repose/adapt/transfer.h"
#include "repose/base/program.h"
#include "repose/base/usage.h"
#include "repose/paper/contest.h"
#include "repose/scene/scene.h"
#include "repose/solve/minimiser.h"
#include "repose/surface/remesh.h"

namespace {

using namespace repose;
using base::check, base::OptionKind, base::VecHandle;
using model::Model;
using paper::Contest, paper::Entry;

const MPI_Comm comm = MPI_COMM_SELF;

const std::vector<std::string> known_methods = {
    "default", "lbfgs", "cycles", "injected", "default_end", "cycles_newton", "lbfgs_newton"};

double dot(Vec x, Vec y) {
  PetscScalar product = 0;
  check(VecDot(x, y, &product));
  return product;
}

/// Where a search is.
struct State {
  explicit State(const discrete::Positions& positions)
      : x(positions.make_vector()), gradient(positions.make_vector()) {}
  VecHandle x, gradient;
  double value = 0;
};

void evaluate(discrete::Function& function, State& state) {
  state.value = function.evaluate(state.x, state.gradient);
}

/// Takes the first of the steps 1, ½, ¼ … along `direction` that lowers the function enough
/// (Armijo), if one does, into `state`, of which `trial` is a spare one.
bool backtrack(discrete::Function& function, Vec direction, State& state, State& trial) {
  constexpr double enough = 1e-4, shortest = 1e-3;
  const double slope = dot(state.gradient, direction);
  if (!(slope < 0)) return false;
  for (double step = 1; step > shortest; step /= 2) {
    check(VecWAXPY(trial.x, step, direction, state.x));
    evaluate(function, trial);
    if (trial.value > state.value + enough * step * slope) continue;
    std::swap(state, trial);
    return true;
  }
  return false;
}

/// The limited-memory BFGS method, whose memory outlives its runs.
class Lbfgs {
 public:
  explicit Lbfgs(const discrete::Positions& positions)
      : direction_(positions.make_vector()), trial_(positions) {
    PetscInt size = 0;
    check(VecGetSize(direction_, &size));
    check(MatCreateLMVMBFGS(comm, size, size, inverse_.out()));
    check(MatLMVMAllocate(inverse_, direction_, direction_));
  }

  /// Goes on until about so many evaluations are spent; false: it cannot.
  bool run(discrete::Function& function, State& state, int64_t evaluations) {
    const int64_t last = function.evaluations() + evaluations;
    while (function.evaluations() < last) {
      check(MatLMVMUpdate(inverse_, state.x, state.gradient));
      PetscInt pairs = 0;
      check(MatLMVMGetUpdateCount(inverse_, &pairs));
      check(MatSolve(inverse_, state.gradient, direction_));
      check(VecScale(direction_,
                     pairs > 0 ? -1 : -first_stride / discrete::largest_block(direction_)));
      if (!backtrack(function, direction_, state, trial_)) return false;
    }
    return true;
  }

 private:
  static constexpr double first_stride = 0.02;  // mm, of the first step, which knows no curvature

  base::MatHandle inverse_;
  VecHandle direction_;
  State trial_;
};

/// A function and a constant force: Φ(y) − v · y.
class Tilted : public discrete::Function {
 public:
  Tilted(discrete::Function& inner, Vec tilt)
      : Function(inner.positions()), inner_(inner), v_(tilt) {}

 private:
  double value_and_gradient(Vec y, Vec gradient) override {
    const double value = inner_.evaluate(y, gradient) - dot(v_, y);
    if (gradient) check(VecAXPY(gradient, -1, v_));
    return value;
  }
  discrete::Function& inner_;
  Vec v_;
};

/// Values at the unknowns in the order of the model [N], and `fixed(row)` at fixed points.
template <class Fixed>
std::vector<Vec3> field(const discrete::Positions& positions, Vec unknowns, const Fixed& fixed) {
  const discrete::Part& part = positions.part();
  std::vector<Vec3> local(part.point_row.size()), all(local.size());
  positions.spread(unknowns, local);
  for (size_t i = 0; i < local.size(); ++i)
    all[part.point_row[i]] = part.unknown[i] >= 0 ? local[i] : fixed(i);
  return all;
}

std::vector<Vec3> increments(const discrete::Positions& positions, Vec unknowns) {
  return field(positions, unknowns, [](size_t) -> Vec3 { return Vec3::Zero(); });
}

std::vector<Vec3> displacements(const discrete::Positions& positions, Vec unknowns) {
  return field(positions, unknowns, [&](size_t i) -> Vec3 {
    return positions.prescribed(static_cast<int64_t>(i), 1) -
           positions.part().model.points.position[i];
  });
}

void take(const discrete::Positions& positions, const std::vector<Vec3>& all, Vec unknowns) {
  const discrete::Part& part = positions.part();
  std::vector<Vec3> local(part.point_row.size());
  for (size_t i = 0; i < local.size(); ++i) local[i] = all[part.point_row[i]];
  positions.keep_owned(local, unknowns);
}

std::vector<Vec3> difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  std::vector<Vec3> result(a.size());
  for (size_t i = 0; i < a.size(); ++i) result[i] = a[i] - b[i];
  return result;
}

/// A solved coarse model.
struct Coarse {
  Model model;
  std::vector<Vec3> rest;  // [N of it] displacements, mm
};

/// Where a coarse correction starts from.
enum class Base {
  rest,      ///< the coarse model's own rest position
  injected,  ///< the fine state, brought down: the textbook's
};

/// MG/OPT on two levels: smoothing by L-BFGS; the coarse function, tilted so that its gradient at
/// the base is the restricted one of the fine function, minimised by the default; how far that
/// takes the coarse model is a direction for a line search; smoothing again.
class Cycles {
 public:
  Cycles(const discrete::Positions& here, const Model& fine, const Coarse& coarse,
         const mechanics::Weights& weights, Base base)
      : here_(here),
        coarse_(coarse),
        part_(discrete::distribute(comm, coarse.model)),
        there_(comm, part_),
        problem_(there_, weights, false),
        injection_(fine, coarse.model),
        transfer_(coarse.model, fine),
        base_(base),
        smoother_(here),
        trial_(here) {
    there_.set_load(1);
  }

  /// One cycle, with about so many evaluations before and after the correction.
  void run(discrete::Function& function, State& state, int64_t smoothing) {
    smoother_.run(function, state, smoothing);
    correct(function, state);
    smoother_.run(function, state, smoothing);
  }

  /// Evaluations of the coarse function, each by its share of the unknowns.
  double coarse_evaluations() {
    return static_cast<double>(problem_.function().evaluations() * part_.total_unknowns) /
           static_cast<double>(here_.part().total_unknowns);
  }
  int64_t corrections() const { return corrections_; }
  int64_t refused() const { return refused_; }  ///< those that led nowhere down

 private:
  void correct(discrete::Function& function, State& state) {
    State coarse(there_);
    const VecHandle base = there_.make_vector(), tilt = there_.make_vector(),
                    direction = here_.make_vector();
    take(there_,
         base_ == Base::rest ? coarse_.rest : injection_.carry(displacements(here_, state.x)),
         base);
    check(VecCopy(base, coarse.x));
    evaluate(problem_.function(), coarse);
    take(there_, transfer_.restrict_gradient(increments(here_, state.gradient)), tilt);
    check(VecAYPX(tilt, -1, coarse.gradient));
    Tilted tilted(problem_.function(), tilt);
    solve::Minimiser(tilted, problem_.solver(), nullptr).run(coarse.x, accuracy_);
    check(VecAXPY(coarse.x, -1, base));
    take(here_, transfer_.prolong(increments(there_, coarse.x)), direction);
    accuracy_ = std::clamp(share * discrete::largest_block(direction), 1e-6, loosest);
    ++corrections_;
    if (!backtrack(function, direction, state, trial_)) ++refused_;
  }

  static constexpr double loosest = 0.05;  // mm, of a coarse minimum, and
  static constexpr double share = 0.1;     // of the last correction, to which it is known

  const discrete::Positions& here_;
  const Coarse& coarse_;
  discrete::Part part_;
  discrete::Positions there_;
  solve::Problem problem_;
  adapt::Transfer injection_, transfer_;
  Base base_;
  Lbfgs smoother_;
  State trial_;
  double accuracy_ = loosest;
  int64_t corrections_ = 0, refused_ = 0;
};

/// What only cycles have.
struct Extra {
  double coarse = 0;  // evaluations of the coarse model, in fine ones
  int64_t corrections = 0, refused = 0;
  std::vector<double> distances;  // mm, least distance from the goal, after each cycle
};

class Runner {
 public:
  explicit Runner(const base::Options& options)
      : options_(options),
        anatomy_(model::load_anatomy(scene::read_scene(options.arguments()[0]))),
        fine_(model::build_model(anatomy_).model) {
    const scene::Scene& scene = anatomy_.scene;
    const auto form = scene.solve.volume.value_or(scene::VolumeForm::penalty);
    if (form != scene::VolumeForm::penalty || scene.tissue.turgor > 0 || scene.gravity)
      base::refuse("{}: the scene must have volume penalty, no turgor and no gravity",
                   options.arguments()[0]);
    weights_ = {1, mechanics::VolumeTerm::penalty, 10 * model::effective_modulus(fine_)};
  }

  void run() {
    climb();
    find_reference();
    const std::string methods = "," + options_.text("methods") + ",";
    for (const std::string& method : known_methods)
      if (methods.find("," + method + ",") != std::string::npos) race(method);
  }

 private:
  Contest make_contest() const {
    return {fine_,
            weights_,
            false,
            {.accuracy = options_.number("accuracy"),
             .limit = options_.integer("limit"),
             .path_seconds = 1e6,
             .seconds = options_.number("seconds")}};
  }

  /// Solves the coarse model, from whose answer all methods start.
  void climb() {
    const scene::Tissue& tissue = anatomy_.scene.tissue;
    const int fewer = std::min(tissue.layers, std::max(3, tissue.layers - 1));
    adapt::Climb wanted;
    wanted.rungs = {{options_.number("coarsening") * surface::even_edge(anatomy_.skin),
                     adapt::layers_are_free(tissue) ? fewer : tissue.layers}};
    wanted.settings.weights = weights_;
    wanted.settings.volume = "penalty";
    wanted.settings.path.accuracy = options_.number("accuracy");
    const double begin = base::cpu_seconds();
    adapt::Ladder ladder = adapt::climb(comm, anatomy_, fine_, wanted);
    if (ladder.rungs.empty()) base::refuse("the coarse model: {}", ladder.refusal);
    const adapt::Rung& rung = ladder.rungs[0];
    start_ = ladder.position;
    coarse_.model = std::move(ladder.last.model);
    coarse_.rest = difference(ladder.last_position, coarse_.model.points.position);
    const auto& sets = fine_.points.set;
    fmt::print(
        "{{\"method\": \"start\", \"unknowns\": {}, \"coarse_unknowns\": {}, "
        "\"evaluations\": {}, \"seconds\": {}}}\n",
        3 * std::count(sets.begin(), sets.end(), model::PointSet::soft_tissue), rung.unknowns,
        rung.evaluations, base::cpu_seconds() - begin);
  }

  void find_reference() {
    Contest contest = make_contest();
    const VecHandle guess = contest.displacement_to(start_);
    contest.follow_path(guess);
    if (!contest.refine(1e-8)) base::refuse("the rest position is not known to 1e-8 mm");
    reference_ = contest.copy_of_reference();
  }

  /// With solvers of its own, so that no method finds another's factors.
  void race(const std::string& method) {
    if (method == "default_end" || method.ends_with("_newton")) return settle(method);
    Contest contest = make_contest();
    contest.set_reference(reference_);
    const VecHandle start = contest.displacement_to(start_);
    if (method == "default") return print(method, contest.race_path(start), {});
    Extra extra;
    const Entry entry = contest.race(method, [&](discrete::Function& function, Vec displacement) {
      State state(function.positions());
      check(VecCopy(start, state.x));
      evaluate(function, state);
      minimise(method, function, state, extra);
      check(VecCopy(state.x, displacement));
    });
    print(method, entry, extra);
  }

  /// Newton's method, after another or alone, until its own estimate is below the accuracy.
  void settle(const std::string& method) const {
    const discrete::Part part = discrete::distribute(comm, fine_);
    discrete::Positions positions(comm, part);
    positions.set_load(1);
    solve::Problem problem(positions, weights_, false);
    paper::Referee referee(problem.function(), reference_,
                           {.accuracy = 0, .limit = INT64_MAX, .seconds = 1e6});
    State state(positions);
    take(positions, difference(start_, fine_.points.position), state.x);
    evaluate(referee, state);
    Extra extra;
    if (method != "default_end") minimise(method, referee, state, extra);
    solve::Minimiser newton(referee, problem.solver(), nullptr);
    if (!newton.run(state.x, options_.number("accuracy")).converged)
      base::refuse("{}: the default's estimate did not come below the accuracy", method);
    Entry entry;
    entry.end = Entry::End::elsewhere;
    entry.evaluations = referee.evaluations();
    entry.assemblies = problem.assemblies();
    entry.seconds = referee.seconds();
    check(VecAXPY(state.x, -1, reference_));
    entry.distance = discrete::largest_block(state.x);
    print(method, entry, extra);
  }

  /// Cycles, or L-BFGS in bouts of as many evaluations, until the function no longer falls or,
  /// before Newton, until one moves the tissue little.
  void minimise(const std::string& method, discrete::Function& function, State& state,
                Extra& extra) const {
    const double little = method.ends_with("_newton") ? options_.number("switch") : 0;
    const int64_t smoothing = options_.integer("smoothing");
    const auto& referee = dynamic_cast<const paper::Referee&>(function);
    Lbfgs lbfgs(function.positions());
    std::optional<Cycles> cycles;
    if (!method.starts_with("lbfgs"))
      cycles.emplace(function.positions(), fine_, coarse_, weights_,
                     method == "injected" ? Base::injected : Base::rest);
    const VecHandle moved = function.positions().make_vector();
    extra = {};
    const auto note = [&] {
      if (!cycles) return;
      extra.coarse = cycles->coarse_evaluations();
      extra.corrections = cycles->corrections();
      extra.refused = cycles->refused();
      extra.distances.push_back(referee.closest());
    };
    try {
      for (double way = little + 1, before = state.value + 1; state.value < before && way > little;
           note()) {
        before = state.value;
        check(VecCopy(state.x, moved));
        if (cycles)
          cycles->run(function, state, smoothing);
        else
          lbfgs.run(function, state, 2 * smoothing);
        check(VecAXPY(moved, -1, state.x));
        way = discrete::largest_block(moved);
      }
    } catch (const paper::RaceOver&) {
      note();
      throw;
    }
  }

  static void print(const std::string& method, const Entry& e, const Extra& extra) {
    static const char* const ends[] = {"reached", "own_minimum", "limit", "elsewhere"};
    fmt::print(
        "{{\"method\": \"{}\", \"end\": \"{}\", \"evaluations\": {}, \"coarse\": {}, "
        "\"assemblies\": {}, \"seconds\": {}, \"distance\": {}, \"excess\": {}, "
        "\"corrections\": {}, \"refused\": {}, \"distances\": [{:.3g}]}}\n",
        method, ends[static_cast<size_t>(e.end)], e.evaluations, extra.coarse, e.assemblies,
        e.seconds, e.distance, e.excess, extra.corrections, extra.refused,
        fmt::join(extra.distances, ", "));
    std::fflush(stdout);
  }

  const base::Options& options_;
  model::Anatomy anatomy_;
  Model fine_;
  Coarse coarse_;
  mechanics::Weights weights_;
  std::vector<Vec3> start_;  // [N] mm
  VecHandle reference_;
};

std::vector<base::Option> option_table() {
  return {{"methods", OptionKind::text, fmt::format("{}", fmt::join(known_methods, ",")),
           "What races."},
          {"accuracy", OptionKind::number, "0.01", "Distance from rest.", {1e-6, 10}, "mm"},
          {"coarsening", OptionKind::number, "3", "Of edges.", {1.2, 10}},
          {"smoothing",
           OptionKind::integer,
           "10",
           "Evaluations before and after each correction.",
           {1, 10000}},
          {"switch",
           OptionKind::number,
           "0.05",
           "Newton follows a cycle (or as many evaluations) that moves the tissue less.",
           {1e-6, 100},
           "mm"},
          {"limit", OptionKind::integer, "5000", "Evaluations.", {1, 1000000000}},
          {"seconds", OptionKind::number, "60", "CPU time of a race.", {1e-3, 1e6}, "s"}};
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Races nonlinear multigrid to a known rest position.",
                        {{"SCENE.yaml", "what is solved"}}, option_table());
  return base::run_program(options, [&] {
    Runner(options).run();
    return base::Exit::done;
  });
}
