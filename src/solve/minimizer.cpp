#include "repose/solve/minimizer.h"

#include <cmath>
#include <utility>

#include "leave_saddle.h"
#include "newton_finish.h"
#include "progress_test.h"
#include "tao_search.h"

namespace repose::solve {

Minimizer::Minimizer(discrete::Function& function, linear::TangentSolver& solver,
                     const Watch& watch)
    : Minimizer(function, solver, {function, solver}, watch) {}

Minimizer::Minimizer(discrete::Function& function, linear::TangentSolver& solver,
                     const ErrorEstimate& estimate, const Watch& watch)
    : function_(function),
      solver_(solver),
      watch_(watch),
      distance_(std::make_unique<RestDistance>(function, estimate)) {
  const bool solid = function.positions().part().solid;
  search_by(solid ? TAOLMVM : TAONTR);
  progress_ = std::make_unique<ProgressTest>(solid);
  finish_ = std::make_unique<NewtonFinish>(function, *distance_);
}

void Minimizer::search_by(TaoType type) {
  tao_ = std::make_unique<TaoSearch>(function_, solver_, type);
  const bool finishes =
      function_.positions().part().solid && tao_->method() == Method::preconditioned;
  test_ = std::make_unique<StoppingTest>(function_, *distance_, tao_->method(), finishes);
}

Minimizer::~Minimizer() = default;

/// Returns what ends a search of TAO's; `outcome` receives whether it was stopped.
std::function<bool(const TaoIterate&)> Minimizer::ending(Outcome& outcome) {
  progress_->begin();
  return [&](const TaoIterate& at) {
    const StoppingTest::Iterate& state = at.state;
    const bool done = test_->ends(state);
    if (watch_ && !done)
      outcome.stopped =
          !watch_({at.number, function_.positions().load(), at.value, state.largest_force,
                   test_->error(), function_.evaluations(), state.displacement});
    const bool in_vain = progress_->ends(
        {function_.evaluations(), at.value, state.largest_force, test_->error(), at.number});
    return done || outcome.stopped || in_vain;
  };
}

Outcome Minimizer::presolve(Vec displacement, double distance) {
  if (tao_->method() != Method::preconditioned) return run(displacement, distance);
  test_->begin(distance, StoppingTest::Criterion::gradient, false);
  Outcome outcome;
  outcome.iterations = tao_->run(displacement, ending(outcome));
  return outcome;
}

Outcome Minimizer::finish(Vec displacement, double accuracy, double taken) {
  test_->begin(accuracy, StoppingTest::Criterion::distance, false);
  return summarize(displacement, accuracy, {}, taken);
}

Outcome Minimizer::run(Vec displacement, double accuracy) {
  constexpr int max_left = 20;  // saddles
  Outcome outcome = search_and_finish(displacement, accuracy);
  const auto leaves = [&] {
    return distance_->of_minimized() && !outcome.stable && !outcome.stopped &&
           leave_saddle(function_, solver_, displacement);
  };
  for (int n = 0; n < max_left && leaves(); ++n) {
    const int64_t iterations = outcome.iterations;
    outcome = search_and_finish(displacement, accuracy);
    outcome.iterations += iterations;
  }
  return outcome;
}

/// Searches and ends by Newton steps. Where limited-memory BFGS fails, as for nearly
/// incompressible tissue under loads, Newton's method takes its place for good.
Outcome Minimizer::search_and_finish(Vec displacement, double accuracy) {
  Outcome outcome;
  int64_t iterations = 0;
  for (const bool may_finish : {true, false}) {
    test_->begin(accuracy, StoppingTest::Criterion::distance, may_finish);
    Outcome found;
    found.iterations = tao_->run(displacement, ending(found));
    outcome = summarize(displacement, accuracy, std::move(found));
    iterations += outcome.iterations;
    // Where Newton steps do not end it, it continues where they led.
    if (!test_->left_to_finish() || outcome.converged || outcome.stopped) break;
  }
  outcome.iterations = iterations;
  const bool ended = outcome.converged || outcome.stopped || !outcome.stable;
  const bool by_newton = TaoSearch::is_chosen() || tao_->method() != Method::preconditioned;
  if (ended || by_newton || progress_->at_rounding()) return outcome;
  search_by(TAONTR);
  outcome = search_and_finish(displacement, accuracy);
  outcome.iterations += iterations;
  return outcome;
}

/// Ends the search whose iterations are `outcome`'s by Newton steps.
Outcome Minimizer::summarize(Vec displacement, double accuracy, Outcome outcome, double taken) {
  const NewtonFinish::End end =
      finish_->run(displacement, accuracy, taken, !test_->left_to_finish());
  outcome.objective = end.objective;
  outcome.gradient_max = end.largest_force;
  outcome.displacement_error = end.error;
  outcome.stable = std::isfinite(end.error) || !distance_->negative_curvature();
  outcome.converged = end.error <= accuracy;
  outcome.iterations += end.corrections;
  outcome.reason = reason_of(outcome);
  if (!outcome.converged && !outcome.stopped && progress_->stalled())
    outcome.reason = no_progress(displacement);
  if (end.corrections > 0)
    outcome.reason += fmt::format(", {} Newton corrections at the rounding level", end.corrections);
  if (!outcome.stable)
    outcome.reason += ", at a point that is not a minimum";
  else if (!std::isfinite(end.error))
    outcome.reason += ", where stiffnesses lie too far apart to estimate the distance to rest";
  return outcome;
}

std::string Minimizer::reason_of(const Outcome& outcome) const {
  if (outcome.stopped && (!outcome.converged || function_.positions().load() < 1))
    return stopped_reason;
  if (outcome.converged) return "rest position within the accuracy";
  if (progress_->at_rounding()) return "the objective no longer decreases beyond rounding";
  return tao_->reason();
}

/// Tells why the search stalls and where. Collective.
std::string Minimizer::no_progress(Vec displacement) const {
  function_.positions().update(displacement);
  const Vec3 at = place_of_largest(function_.positions(), finish_->gradient());
  return fmt::format(
      "no progress in {} evaluations: the largest force stays at {:.3g} N, now near {:.1f} mm",
      ProgressTest::patience, progress_->smallest_force(), at);
}

}  // namespace repose::solve
