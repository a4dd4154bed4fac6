#include "repose/solve/load_path.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace repose::solve {

using base::check;

namespace {

constexpr double unknown = std::numeric_limits<double>::infinity();

constexpr int most_halvings = 5;     // of a short step that fails or strays
constexpr double most_steps = 1000;  // without halvings: a motion of kilometres is no longer path
// Of the predicted increment, beyond which a step is halved:
constexpr double trusted_miss = 0.5;
constexpr double trusted_defect = 0.25;

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

LoadPath::LoadPath(discrete::Objective& objective, Predictor& predictor, RestSearch& search,
                   const PathSettings& settings)
    : objective_(objective),
      predictor_(predictor),
      search_(search),
      settings_(settings),
      trial_(objective.positions().make_vector()),
      increment_(objective.positions().make_vector()) {}

double LoadPath::step_of(double stride) const {
  if (settings_.load_steps > 0) return 1.0 / settings_.load_steps;
  const double travel = objective_.positions().largest_travel();
  return 1.0 / std::clamp(std::ceil(travel / stride), 1.0, most_steps);
}

double LoadPath::longest_step() const {
  if (objective_.positions().part().solid) return short_step_;
  // Meshes so fine that tissue buckles seldom allow long steps.
  constexpr int64_t fine = 100000;  // scalar unknowns
  const bool buckles = 3 * objective_.positions().part().total_unknowns > fine;
  const bool brief = buckles || settings_.longest_stride < short_stride;
  return brief ? short_step_ : step_of(settings_.longest_stride);
}

int64_t LoadPath::inverted(Vec displacement) {
  objective_.positions().update(displacement);
  return objective_.totals().inverted;
}

LoadPath::Attempt LoadPath::attempt(Vec displacement, double load) {
  discrete::Positions& positions = objective_.positions();
  const double before = positions.load(), step = load - before;
  const int64_t folded_before = inverted(displacement);
  const bool predicted = predictor_.predict(displacement, load, increment_);
  Attempt attempt;
  if (!predicted && is_long(step)) return attempt;
  check(VecCopy(displacement, trial_));
  if (predicted) check(VecAXPY(trial_, 1.0, increment_));
  positions.set_load(load);
  attempt.outcome = search_.run(trial_, settings_.accuracy);
  result_.iterations += attempt.outcome.iterations;
  attempt.folded = inverted(trial_) > folded_before;
  if (!predicted) return attempt;
  attempt.expected = discrete::largest_block(increment_);
  check(VecAXPY(increment_, 1.0, displacement));
  check(VecAXPY(increment_, -1.0, trial_));
  attempt.miss = discrete::largest_block(increment_);
  const bool sound = attempt.outcome.converged && !attempt.folded;
  // A jump cannot hide in a miss that short steps would have let pass.
  const double hidden = trusted_miss * attempt.expected * std::min(1.0, short_step_ / step);
  if (is_long(step) && sound && attempt.miss > hidden + settings_.accuracy)
    attempt.defect = attempt.miss <= attempt.expected ? defect(displacement, before) : unknown;
  return attempt;
}

double LoadPath::defect(Vec displacement, double before) {
  base::VecHandle back = objective_.positions().make_vector();
  if (!predictor_.predict(trial_, before, back)) return unknown;
  // The misses of both predictions, whose difference is twice what the trapezoidal rule misses.
  check(VecAXPY(back, 1.0, trial_));
  check(VecAXPY(back, -1.0, displacement));
  check(VecAXPY(back, -1.0, increment_));
  return discrete::largest_block(back) / 2;
}

bool LoadPath::follows(const Attempt& now, bool is_long, const Attempt* coarser) const {
  if (!now.outcome.converged) return false;
  if (is_long)
    return !now.folded && now.defect <= trusted_defect * now.expected + settings_.accuracy;
  // Halving shrinks what a smooth path misses by four. What it does not shrink, a jump of the rest
  // position itself or a fold, is the path's own.
  const bool near = settings_.hasty || now.miss <= trusted_miss * now.expected + settings_.accuracy;
  return (near && !now.folded) || (coarser && coarser->outcome.converged &&
                                   now.folded == coarser->folded && now.miss > 0.5 * coarser->miss);
}

void LoadPath::settle(Vec displacement, const OnStep& on_step) {
  const Stopwatch watch;
  objective_.positions().set_load(result_.load);
  result_.last = search_.run(displacement, settings_.accuracy);
  result_.iterations += result_.last.iterations;
  ++result_.steps;
  objective_.positions().update(displacement);
  on_step(result_.last, result_.load, watch.seconds());
}

void LoadPath::accept(const Outcome& outcome, double load, Vec displacement) {
  result_.last = outcome;
  result_.load = load;
  ++result_.steps;
  check(VecCopy(trial_, displacement));
  objective_.positions().update(displacement);
}

void LoadPath::leap(Vec displacement, Vec guess, const OnStep& on_step) {
  const Stopwatch watch;
  const double before = result_.load;
  const int64_t folded_before = inverted(displacement);
  check(VecCopy(guess, trial_));
  objective_.positions().set_load(1);
  const Outcome outcome = search_.run(trial_, settings_.accuracy);
  result_.iterations += outcome.iterations;
  if (outcome.stopped || (outcome.converged && inverted(trial_) <= folded_before)) {
    accept(outcome, 1, displacement);
    result_.leapt = true;
    on_step(outcome, 1, watch.seconds());
  } else {
    objective_.positions().set_load(before);
    objective_.positions().update(displacement);
    search_.go_back(displacement);
  }
}

PathOutcome LoadPath::run(Vec displacement, Vec guess, const OnStep& on_step) {
  discrete::Positions& positions = objective_.positions();
  result_ = {};
  result_.load = positions.largest_travel() > 0 ? settings_.start_load : 1.0;
  settle(displacement, on_step);
  if (guess && result_.last.converged && !result_.last.stopped && result_.load < 1)
    leap(displacement, guess, on_step);
  short_step_ = step_of(positions.part().solid ? solid_stride : short_stride);
  double longest = longest_step();
  double step = longest;
  int halvings = 0;
  std::optional<Attempt> coarser;
  while (result_.last.converged && !result_.last.stopped && result_.load < 1) {
    const Stopwatch watch;
    const double before = result_.load;
    double target = before + step;
    if (target > 1 - 1e-3 * short_step_) target = 1;
    const bool far = is_long(target - before);
    const Attempt tried = attempt(displacement, target);
    const bool last_chance = halvings == most_halvings;
    if (!tried.outcome.stopped && !last_chance &&
        !follows(tried, far, coarser ? &*coarser : nullptr)) {
      positions.set_load(before);
      search_.go_back(displacement);
      ++result_.halvings;
      if (far) {
        step = longest = std::max(step / 2, short_step_);
      } else {
        step /= 2;
        ++halvings;
        coarser = tried;
      }
      continue;
    }
    accept(tried.outcome, target, displacement);
    step = std::min(longest, 2 * step);
    halvings = std::max(0, halvings - 1);
    coarser.reset();
    on_step(result_.last, result_.load, watch.seconds());
  }
  return result_;
}

}  // namespace repose::solve
