#include "repose/solve/load_path.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace repose::solve {

using base::check;

namespace {

constexpr int most_halvings = 5;      // of one step
constexpr double trusted_miss = 0.5;  // of the predicted increment, beyond which a step is halved

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

LoadPath::LoadPath(Objective& objective, Minimiser& minimiser, const PathSettings& settings)
    : objective_(objective),
      minimiser_(minimiser),
      settings_(settings),
      trial_(objective.positions().make_vector()),
      increment_(objective.positions().make_vector()) {}

double LoadPath::first_step() const {
  if (settings_.load_steps > 0) return 1.0 / settings_.load_steps;
  const double travel = objective_.positions().largest_travel();
  return 1.0 / std::max(1.0, std::ceil(travel / automatic_stride));
}

int64_t LoadPath::inverted(Vec displacement) {
  objective_.positions().update(displacement);
  return objective_.totals().inverted;
}

LoadPath::Attempt LoadPath::attempt(Vec displacement, double load, bool last_chance) {
  Positions& positions = objective_.positions();
  const int64_t folded_before = inverted(displacement);
  const bool predicted = minimiser_.predict(displacement, load, increment_);
  check(VecCopy(displacement, trial_));
  if (predicted) check(VecAXPY(trial_, 1.0, increment_));
  positions.set_load(load);
  Attempt attempt{minimiser_.run(trial_, settings_.accuracy), false};
  result_.iterations += attempt.outcome.iterations;
  const bool folded = inverted(trial_) > folded_before;
  const double expected = predicted ? largest_block(increment_) : 0;
  check(VecAXPY(increment_, 1.0, displacement));
  check(VecAXPY(increment_, -1.0, trial_));
  const double miss = predicted ? largest_block(increment_) : 0;
  const bool strayed = miss > trusted_miss * expected + settings_.accuracy;
  attempt.accepted = attempt.outcome.converged && (last_chance || (!folded && !strayed));
  return attempt;
}

void LoadPath::settle(Vec displacement, const OnStep& on_step) {
  const Stopwatch watch;
  objective_.positions().set_load(result_.load);
  result_.last = minimiser_.run(displacement, settings_.accuracy);
  result_.iterations += result_.last.iterations;
  ++result_.steps;
  objective_.positions().update(displacement);
  on_step(result_.last, result_.load, watch.seconds());
}

PathOutcome LoadPath::run(Vec displacement, const OnStep& on_step) {
  Positions& positions = objective_.positions();
  result_ = {};
  result_.load = positions.largest_travel() > 0 ? settings_.start_load : 1.0;
  settle(displacement, on_step);
  const double full_step = first_step();
  double step = full_step;
  while (result_.last.converged && result_.load < 1) {
    const Stopwatch watch;
    const double before = result_.load;
    double target = before + step;
    if (target > 1 - 1e-3 * full_step) target = 1;
    const bool last_chance = step <= full_step * std::pow(0.5, most_halvings);
    const Attempt tried = attempt(displacement, target, last_chance);
    if (!tried.accepted && !last_chance) {
      positions.set_load(before);
      step /= 2;
      ++result_.halvings;
      continue;
    }
    result_.last = tried.outcome;
    result_.load = target;
    ++result_.steps;
    step = std::min(full_step, 2 * step);
    check(VecCopy(trial_, displacement));
    positions.update(displacement);
    on_step(result_.last, result_.load, watch.seconds());
  }
  return result_;
}

}  // namespace repose::solve
