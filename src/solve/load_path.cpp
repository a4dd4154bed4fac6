#include "repose/solve/load_path.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pierced_columns.h"

namespace repose::solve {

using base::check;

namespace {

constexpr int max_halvings = 5;  // of a step that fails or strays
// Evaluations of steps that are made again, at most, and so many more for each of a step taken.
constexpr int64_t max_refused = 2000, refused_a_taken = 2;
constexpr double trusted_miss = 0.5;  // of the predicted increment; beyond, a step is halved

// The way of the fastest point in an automatic step, mm, at most: longer steps may jump between the
// rest positions that springs have; a solid's searches end at one from as far.
constexpr double spring_stride = 5, solid_stride = 20;
constexpr double max_steps = 1000;  // without halvings: a motion of kilometers is no longer path

// λ/μ with which a step begins where volumes are stiffer, that of ν = 0.45, and by how much it
// grows from one search to the next, each of which comes so near to rest, mm.
constexpr double softest_bulk = 9, bulk_growth = 6, presolved_to = 0.1;
constexpr double stiff_bulk = 30;  // ν = 0.484: below, softer volumes first save nothing

/// Limits λ of a solid to `max_bulk` times μ as long as it lives.
class BulkLimit {
 public:
  BulkLimit(discrete::Objective& objective, discrete::Tangent& tangent, double max_bulk)
      : objective_(objective), tangent_(tangent) {
    set(max_bulk);
  }
  ~BulkLimit() { set(std::numeric_limits<double>::infinity()); }
  BulkLimit(BulkLimit&&) = delete;

 private:
  void set(double max_bulk) {
    objective_.limit_bulk(max_bulk);
    tangent_.invalidate();
  }
  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
};

/// A state whose energy overflows is none to write.
void require_value(const Outcome& outcome, double load) {
  if (outcome.objective >= discrete::overflown) discrete::refuse_overflow("energies", load);
}

}  // namespace

LoadPath::LoadPath(Problem& problem, RestSearch& search, const PathSettings& settings)
    : problem_(problem),
      objective_(problem.objective()),
      tangent_(problem.tangent()),
      function_(problem.function()),
      predictor_(objective_, problem.elastic_solver()),
      search_(search),
      settings_(settings),
      trial_(objective_.positions().make_vector()),
      increment_(objective_.positions().make_vector()) {}

double LoadPath::automatic_step() const {
  const discrete::Positions& positions = objective_.positions();
  const double stride = positions.part().solid ? solid_stride : spring_stride;
  return 1.0 / std::clamp(std::ceil(positions.largest_travel() / stride), 1.0, max_steps);
}

double LoadPath::requested_step() const {
  return settings_.load_steps > 0 ? 1.0 / settings_.load_steps : automatic_step();
}

/// Returns true if load 1 has to be reached again from load 0: with contact, where other steps than
/// the automatic ones are requested or led to the state of a restarted run.
bool LoadPath::ends_in_automatic_steps() const {
  constexpr double nearly = 1e-9;
  if (!objective_.positions().part().contact || settings_.ends_along) return false;
  if (result_.load == 0) return requested_step() != automatic_step();
  const double steps = result_.load / automatic_step();
  return std::abs(steps - std::round(steps)) > nearly;
}

int64_t LoadPath::inverted(Vec displacement) {
  objective_.positions().update(displacement);
  return objective_.totals().inverted;
}

/// Returns true if volumes are so stiff that a step begins with softer ones.
bool LoadPath::begins_softer() const {
  return objective_.largest_bulk() > stiff_bulk && !objective_.positions().part().contact;
}

bool LoadPath::predict(Vec displacement, double load) {
  if (const auto own = search_.predict(displacement, load, increment_)) return *own;
  if (begins_softer()) {
    const BulkLimit limit(objective_, tangent_, softest_bulk);
    if (predictor_.predict(displacement, load, increment_)) return true;
  }
  return predictor_.predict(displacement, load, increment_);
}

/// Takes trial_ near the rest position of softer volumes, then of stiffer ones. A prediction
/// that rotates tissue by θ changes its volume by a share θ², to which nearly incompressible tissue
/// is so stiff that a search returns in many short steps.
void LoadPath::presolve_softer() {
  for (double bulk = softest_bulk; 2 * bulk < objective_.largest_bulk(); bulk *= bulk_growth) {
    const BulkLimit limit(objective_, tangent_, bulk);
    const double distance = std::max(settings_.accuracy, presolved_to);
    result_.iterations += search_.presolve(trial_, distance).iterations;
  }
}

/// Begins a step to `load`: takes trial_ to the predicted end, where there is a prediction.
LoadPath::Attempt LoadPath::begin_step(Vec displacement, double load) {
  Attempt step;
  step.inverted = inverted(displacement);
  step.begun = function_.evaluations();
  step.before = search_.pressures();
  step.predicted = predict(displacement, load);
  if (step.predicted) {
    step.expected = discrete::largest_block(increment_);
    check(VecAXPY(increment_, 1.0, displacement));
  }
  check(VecCopy(step.predicted ? increment_ : displacement, trial_));
  objective_.positions().set_load(load);
  if (begins_softer()) presolve_softer();
  return step;
}

/// Takes in what the step ended in, at trial_.
void LoadPath::end_step(Attempt& step) {
  step.evaluations = function_.evaluations() - step.begun;
  result_.iterations += step.outcome.iterations;
  step.folded = inverted(trial_) > step.inverted;
  if (!step.predicted) return;
  check(VecAXPY(increment_, -1.0, trial_));
  step.miss = discrete::largest_block(increment_);
}

bool LoadPath::follows(const Attempt& now, const std::optional<Attempt>& coarser) const {
  if (!now.outcome.converged) return false;
  // No prediction includes contact that begins in the step.
  const bool touching = objective_.positions().part().contact;
  const bool near = touching || now.miss <= trusted_miss * now.expected + settings_.accuracy;
  if (near && !now.folded) return true;
  // Halving shrinks what a smooth path misses by four. What it does not shrink, a jump of the rest
  // position itself or a fold, is the path's own.
  return coarser && coarser->outcome.converged && now.folded == coarser->folded &&
         now.miss > 0.5 * coarser->miss;
}

void LoadPath::settle(Vec displacement, const OnStep& on_step) {
  const double begin = MPI_Wtime();
  objective_.positions().set_load(result_.load);
  result_.last = settings_.start_load > 0 ? search_.run_near(displacement, settings_.accuracy)
                                          : search_.run(displacement, settings_.accuracy);
  if (result_.load == 1) search_.find_other(displacement, settings_.accuracy, result_.last);
  result_.iterations += result_.last.iterations;
  require_value(result_.last, result_.load);
  objective_.positions().update(displacement);
  refuse_end();
  on_step(result_.last, result_.load, MPI_Wtime() - begin);
}

void LoadPath::accept(const Outcome& outcome, double load, Vec displacement) {
  require_value(outcome, load);
  result_.last = outcome;
  result_.load = load;
  ++result_.steps;
  check(VecCopy(trial_, displacement));
  objective_.positions().update(displacement);
  refuse_end();
}

void LoadPath::reject_step(const Attempt& tried) {
  objective_.positions().set_load(result_.load);
  search_.set_pressures(tried.before);
  refused_ += tried.evaluations;
  Halvings& h = result_.halvings;
  ++(!tried.outcome.converged ? h.failed : tried.folded ? h.folded : h.off_prediction);
}

void LoadPath::try_guess(Vec displacement, Vec guess, const OnStep& on_step) {
  const double begin = MPI_Wtime();
  const double before = result_.load;
  const int64_t folded_before = inverted(displacement);
  // Those at a near guess are not those at the start of the path.
  const discrete::ContactPressures pressures =
      settings_.near_guess ? discrete::ContactPressures{} : search_.pressures();
  check(VecCopy(guess, trial_));
  objective_.positions().set_load(1);
  Outcome outcome = settings_.near_guess ? search_.run_near(trial_, settings_.accuracy)
                                         : search_.run(trial_, settings_.accuracy);
  search_.find_other(trial_, settings_.accuracy, outcome);
  result_.iterations += outcome.iterations;
  if (outcome.stopped || (outcome.converged && inverted(trial_) <= folded_before)) {
    accept(outcome, 1, displacement);
    result_.leapt = true;
    on_step(result_.last, 1, MPI_Wtime() - begin);
  } else {
    objective_.positions().set_load(before);
    objective_.positions().update(displacement);
    search_.set_pressures(pressures);
  }
}

bool LoadPath::in_vain(const Attempt& tried) const {
  const int64_t taken = function_.evaluations() - tried.evaluations - begun_ - refused_;
  return refused_ > max_refused + refused_a_taken * taken;
}

/// Explains the step that ends the path without rest.
void LoadPath::explain_failure() {
  if (result_.last.converged || result_.last.stopped || result_.halvings.count() == 0) return;
  result_.last.reason += fmt::format("; {} load steps have been halved, which took {} evaluations",
                                     result_.halvings.count(), refused_);
}

/// Refuses an end of the path that is no rest position: points had to be released from bodies that
/// overlap, or an instrument, which only points of the skin touch, is inside the tissue. At the
/// positions' last update.
void LoadPath::refuse_end() {
  Outcome& last = result_.last;
  if (result_.load < 1 || !last.converged) return;
  const PiercedColumns by = find_columns_in_instruments(objective_);
  last.pierced = by.count();
  if (last.overlapped == 0 && last.pierced == 0) return;
  last.converged = false;
  last.reason =
      last.overlapped > 0
          ? fmt::format("points of tissue between bodies that overlap: {}", last.overlapped)
      : by.columns > 0 ? fmt::format("columns of tissue pierced by an instrument: {}", by.columns)
                       : fmt::format("prisms of tissue pierced by an instrument: {}", by.prisms);
}

PathOutcome LoadPath::run(Vec displacement, Vec guess, const OnStep& on_step) {
  discrete::Positions& positions = objective_.positions();
  result_ = {};
  refused_ = 0;
  begun_ = function_.evaluations();
  result_.load = positions.largest_travel() > 0 ? settings_.start_load : 1.0;
  if (guess && settings_.near_guess && result_.load < 1) {
    positions.set_load(result_.load);
    try_guess(displacement, guess, on_step);
    if (result_.leapt) return result_;
  }
  const base::VecHandle start = positions.make_vector();
  settle(displacement, on_step);
  if (guess && !settings_.near_guess && result_.last.converged && !result_.last.stopped &&
      result_.load < 1)
    try_guess(displacement, guess, on_step);
  if (!ends_in_automatic_steps()) {
    follow(displacement, requested_step(), 1, on_step);
    return result_;
  }
  follow(displacement, requested_step(), 1 - requested_step(), on_step);
  if (result_.last.converged && !result_.last.stopped && result_.load < 1)
    follow_again(start, displacement, on_step);
  return result_;
}

/// Takes steps of at most `longest` until the load is `end`.
void LoadPath::follow(Vec displacement, double longest, double end, const OnStep& on_step) {
  const double nearly = 1e-3 * longest;
  double step = longest;
  int halvings = 0;
  std::optional<Attempt> coarser;
  while (result_.last.converged && !result_.last.stopped && result_.load < end - nearly) {
    const double begin = MPI_Wtime();
    const double target = result_.load + step;
    const double load = target > 1 - nearly ? 1 : target;
    Attempt tried = begin_step(displacement, load);
    tried.outcome = search_.run(trial_, settings_.accuracy);
    if (load == 1) search_.find_other(trial_, settings_.accuracy, tried.outcome);
    end_step(tried);
    const bool last = halvings == max_halvings || in_vain(tried);
    if (tried.outcome.stopped || last || follows(tried, coarser)) {
      accept(tried.outcome, load, displacement);
      explain_failure();
      step = std::min(longest, 2 * step);
      halvings = std::max(0, halvings - 1);
      coarser.reset();
      on_step(result_.last, result_.load, MPI_Wtime() - begin);
    } else {
      reject_step(tried);
      step /= 2;
      ++halvings;
      coarser = tried;
    }
  }
}

/// Goes to load 1 from the `start` of the path, in automatic steps of which the last is reported,
/// as if no others had been requested: linear solvers and contact are reset first. Where they
/// fail, the path continues from `displacement`, which the requested steps have reached.
void LoadPath::follow_again(Vec start, Vec displacement, const OnStep& on_step) {
  const double begin = MPI_Wtime();
  const discrete::ContactPressures reached_pressures = search_.pressures();
  const PathOutcome reached = result_;
  discrete::Positions& positions = objective_.positions();
  problem_.reset();
  search_.set_pressures({});
  begun_ = function_.evaluations();
  refused_ = 0;
  result_.load = 0;
  positions.set_load(0);
  result_.last = search_.run(start, settings_.accuracy);
  result_.iterations += result_.last.iterations;
  follow(start, automatic_step(), 1, [](const Outcome&, double, double) {});
  const bool refused = result_.last.overlapped > 0 || result_.last.pierced > 0;
  if (result_.complete() || (result_.load == 1 && refused)) {
    check(VecCopy(start, displacement));
    result_.steps = reached.steps + 1;
    on_step(result_.last, result_.load, MPI_Wtime() - begin);
    return;
  }
  const bool stopped = result_.last.stopped;
  const int64_t iterations = result_.iterations;
  result_ = reached;
  result_.iterations = iterations;
  result_.last.stopped = stopped;
  positions.set_load(result_.load);
  positions.update(displacement);
  objective_.contact().place_bodies();
  search_.set_pressures(reached_pressures);
  follow(displacement, requested_step(), 1, on_step);
}

Predictor::Predictor(discrete::Objective& objective, linear::TangentSolver& solver)
    : objective_(objective), solver_(solver), force_(objective.positions().make_vector()) {}

bool Predictor::predict(Vec displacement, double load, Vec increment) {
  discrete::Positions& positions = objective_.positions();
  positions.update(displacement);
  objective_.hessian_action(positions.travel_to(load), force_);
  objective_.add_carried(load, force_);
  check(VecScale(force_, -1));
  check(VecSet(increment, 0));
  // A weak preconditioner's norm does not see smooth errors: after 1e-2 of it an increment can miss
  // by more than the path trusts, and steps are halved for nothing.
  const double close = positions.part().solid ? 1e-2 : 1e-5;
  bool convex = solver_.solve(displacement, force_, increment, close);
  // Where iterations ran out, the preconditioner is worn out and the next solve renews it.
  if (convex && !solver_.finished()) convex = solver_.solve(displacement, force_, increment, close);
  return convex && solver_.finished();
}

}  // namespace repose::solve
