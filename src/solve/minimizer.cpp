#include "repose/solve/minimizer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "initial_hessian.h"
#include "leave_saddle.h"
#include "progress_test.h"
#include "repose/base/error.h"
#include "repose/base/petsc.h"
#include "repose/solve/supported.h"

namespace repose::solve {

using base::check;

namespace {

constexpr double safety = 2;     // the estimate is this many Newton steps long
constexpr double linear = 1e-6;  // mm, below which a Newton step need not be confirmed
// Of the accuracy: where a preconditioned gradient this long is worth a Newton step, which also
// says how far the rest position is; and one so short that it is rest, whatever the preconditioner.
constexpr double closing = 5, negligible = 1e-6;
constexpr double farthest_closing = 0.2;  // mm, whatever the accuracy
constexpr double sure_share = 0.05;       // of the accuracy, what a linear system may leave unknown
// A step by which the next is not shorter than this is no measure: the search goes on.
constexpr double trusted_contraction = 0.7, max_contraction = 0.99;
// Newton's linear systems are solved to this much of their right-hand side: roughly far from the
// rest position, closely near it (superlinear: Dembo, Eisenstat & Steihaug 1982).
constexpr double coarsest_forcing = 0.1, finest_forcing = 1e-3;

bool has_type(Tao tao, TaoType type) {
  PetscBool same = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(tao), type, &same));
  return same;
}

bool uses_hessian(Tao tao) {
  PetscBool newton = PETSC_FALSE;
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(tao), &newton, TAONLS, TAONTR,
                                  TAONTL, TAOBNLS, TAOBNTR, TAOBNTL, ""));
  return newton;
}

std::string reason_text(TaoConvergedReason reason) {
  switch (reason) {
    case TAO_CONVERGED_USER:
      return "rest position within the accuracy";
    case TAO_CONVERGED_GATOL:
    case TAO_CONVERGED_GRTOL:
    case TAO_CONVERGED_GTTOL:
      return "gradient below -tao tolerance";
    case TAO_DIVERGED_MAXITS:
      return "iteration limit (-tao_max_it)";
    case TAO_DIVERGED_MAXFCN:
      return "evaluation limit (-tao_max_funcs)";
    case TAO_DIVERGED_LS_FAILURE:
      return "line search failed";
    case TAO_DIVERGED_TR_REDUCTION:
      return "trust region vanished";
    case TAO_DIVERGED_NAN:
      return "values not finite";
    default:
      return std::string("TAO: ") + TaoConvergedReasons[reason];
  }
}

}  // namespace

/// The C functions TAO calls. Nothing is thrown through C: an exception is kept for run().
struct Minimizer::Callbacks {
  template <class Work>
  static PetscErrorCode guarded(void* context, Work&& work) {
    auto* self = static_cast<Minimizer*>(context);
    try {
      work(*self);
      return PETSC_SUCCESS;
    } catch (...) {
      self->thrown_ = std::current_exception();
      return PETSC_ERR_USER;
    }
  }

  static PetscErrorCode value_and_gradient(Tao, Vec x, PetscReal* value, Vec gradient, void* me) {
    return guarded(me, [&](Minimizer& self) { *value = self.function_.evaluate(x, gradient); });
  }

  /// TAO's own way to the value alone leaves its vector behind where an evaluation fails.
  static PetscErrorCode value(Tao, Vec x, PetscReal* value, void* me) {
    return guarded(
        me, [&](Minimizer& self) { *value = self.function_.evaluate(x, self.estimate_gradient_); });
  }

  static PetscErrorCode hessian(Tao, Vec x, Mat, Mat, void* me) {
    return guarded(me, [&](Minimizer& self) {
      self.solver_.prepare(x);
      self.set_forcing();
    });
  }

  static PetscErrorCode converged(Tao tao, void* me) {
    return guarded(me, [&](Minimizer& self) {
      PetscInt iteration = 0;
      PetscReal value = 0, length = 0;
      check(TaoGetSolutionStatus(tao, &iteration, &value, nullptr, nullptr, &length, nullptr));
      self.cut_ = self.newton_ && iteration > 0 && self.step_was_cut();
      iteration += self.iterations_;
      Vec x = nullptr, g = nullptr;
      check(TaoGetSolution(tao, &x));
      check(TaoGetGradient(tao, &g, nullptr, nullptr));
      const double force = discrete::largest_block(g);
      self.force_ = force;
      if (iteration == 0) self.first_force_ = force;
      const bool done = self.near_enough(x, g, force);
      if (self.watch_ && !done)
        self.stopped_ = !self.watch_({iteration, self.function_.positions().load(), value, force,
                                      self.error_, self.function_.evaluations(), x});
      check(TaoDefaultConvergenceTest(tao, nullptr));
      const bool stalled =
          self.stalled(iteration, value) ||
          (self.function_.positions().part().solid &&  // springs converge as slowly
           self.progress_->stalls({self.function_.evaluations(), value, force, self.error_}));
      const bool over = done || self.stopped_ || stalled;
      self.slowed_ = !over && self.initial_ && self.initial_->needs_renewal(force, length);
      if (over || self.slowed_) check(TaoSetConvergedReason(tao, TAO_CONVERGED_USER));
    });
  }
};

Minimizer::Minimizer(discrete::Function& function, linear::TangentSolver& solver,
                     const Watch& watch)
    : Minimizer(function, solver, {function, solver}, watch) {}

Minimizer::Minimizer(discrete::Function& function, linear::TangentSolver& solver,
                     const ErrorEstimate& estimate, const Watch& watch)
    : function_(function),
      solver_(solver),
      estimate_(estimate),
      newton_estimate_(estimate.solver),
      watch_(watch),
      progress_(std::make_unique<ProgressTest>()),
      gradient_(function.positions().make_vector()),
      saved_(function.positions().make_vector()),
      trial_(function.positions().make_vector()),
      estimate_gradient_(function.positions().make_vector()) {
  make_tao();
}

Minimizer::~Minimizer() = default;

void Minimizer::make_tao() {
  require_supported_types();
  check(TaoCreate(function_.positions().comm(), tao_.out()));
  check(TaoSetType(tao_, function_.positions().part().solid ? TAOLMVM : TAONTR));
  check(TaoSetObjective(tao_, Callbacks::value, this));
  check(TaoSetObjectiveAndGradient(tao_, nullptr, Callbacks::value_and_gradient, this));
  check(TaoSetHessian(tao_, solver_.hessian().model(), solver_.preconditioner().matrix(),
                      Callbacks::hessian, this));
  check(TaoSetTolerances(tao_, 0, 0, 0));
  check(TaoSetMaximumIterations(tao_, 5000));
  check(TaoSetMaximumFunctionEvaluations(tao_, 100000));
  check(TaoSetConvergenceTest(tao_, Callbacks::converged, this));
  base::check_options(TaoSetFromOptions(tao_));
  if (has_type(tao_, TAOLMVM) && begins_with_stiffness(function_.positions()))
    initial_ = std::make_unique<InitialHessian>(tao_, solver_);
  newton_finish_enabled_ = initial_ && function_.positions().part().solid;
  newton_ = uses_hessian(tao_);
  if (!newton_) return;
  KSP inner = nullptr;
  check(TaoGetKSP(tao_, &inner));
  solver_.preconditioner().attach(inner);
  check(KSPSetNormType(inner, KSP_NORM_NATURAL));
  check(KSPSetTolerances(inner, coarsest_forcing, 0.0, PETSC_DEFAULT, 200));
  base::check_options(KSPSetFromOptions(inner));
  const char* prefix = nullptr;
  check(KSPGetOptionsPrefix(inner, &prefix));
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, prefix, "-ksp_rtol", &given));
  automatic_forcing_ = !given;
}

void Minimizer::set_forcing() {
  if (!newton_ || !automatic_forcing_ || first_force_ == 0) return;
  KSP inner = nullptr;
  check(TaoGetKSP(tao_, &inner));
  const double forcing =
      std::clamp(std::sqrt(force_ / first_force_), finest_forcing, coarsest_forcing);
  check(KSPSetTolerances(inner, forcing, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
}

bool Minimizer::step_was_cut() const {
  KSP inner = nullptr;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(TaoGetKSP(tao_, &inner));
  check(KSPGetConvergedReason(inner, &reason));
  return reason != KSP_CONVERGED_RTOL && reason != KSP_CONVERGED_ATOL &&
         reason != KSP_CONVERGED_ITS && reason != KSP_DIVERGED_ITS;
}

double Minimizer::strict_estimate(Vec displacement, Vec gradient, bool last) {
  if (&estimate_.function != &function_) {
    estimate_.function.evaluate(displacement, estimate_gradient_);
    gradient = estimate_gradient_;
  }
  double step = newton_estimate_.distance(displacement, gradient);
  double unsure = 0;
  if (last || safety * step <= accuracy_) {
    step = newton_estimate_.bound(displacement, gradient, sure_share * accuracy_);
    unsure = newton_estimate_.error_slack();
  }
  const double estimate = safety * step + unsure;
  const bool curved = estimate > linear && estimate <= accuracy_;
  if (!curved) return estimate;
  // A step just taken says as much of the quadratic model as one on trial.
  const bool contracted = taken_ > 0 && step <= trusted_contraction * taken_;
  const double left = contracted ? step / taken_ : contraction(displacement);
  return std::max(estimate, step / (1 - left));
}

double Minimizer::contraction(Vec displacement) {
  const discrete::Hessian& hessian = estimate_.solver.hessian();
  if (contracted_at_ == hessian.assemblies()) return contraction_;
  check(VecWAXPY(trial_, -1.0, newton_estimate_.step(), displacement));
  estimate_.function.evaluate(trial_, estimate_gradient_);
  const double found = newton_estimate_.contraction(displacement, trial_, estimate_gradient_);
  contraction_ = found <= trusted_contraction ? found : max_contraction;
  contracted_at_ = hessian.assemblies();
  return contraction_;
}

double Minimizer::distance_without_force(Vec displacement) {
  return newton_estimate_.is_minimum(displacement) ? 0 : std::numeric_limits<double>::infinity();
}

/// An estimate costs the solution of a linear system: only where the force that went with a
/// distance at the last one says that it is worth it. A Newton method's steps go further, but one
/// cut off by the trust region or negative curvature hardly comes to a convex place.
bool Minimizer::worth_estimating(double largest_force) const {
  if (softest_ == 0 || presolving_) return true;
  const double hopeful = newton_ ? 20 : 2;
  constexpr int64_t seldom = 20;  // evaluations: it costs other methods as much as many of them
  const bool far = largest_force > hopeful * softest_ * accuracy_;
  const bool soon = !newton_ && !initial_ && function_.evaluations() - estimated_at_ < seldom;
  return !far && !soon && !cut_;
}

/// By the preconditioned gradient alone; nothing where the estimate has to tell.
std::optional<bool> Minimizer::near_enough_at_a_step(Vec gradient) {
  const bool preconditioned = newton_ || initial_;
  if (!preconditioned || &estimate_.function != &function_) return {};
  const double step = newton_estimate_.preconditioned_distance(gradient);
  const double near = std::max(accuracy_, std::min(closing * accuracy_, farthest_closing));
  std::optional<bool> answer;
  if (presolving_)
    answer = step <= accuracy_;
  else if (step > (newton_finish_allowed_ ? near : accuracy_))
    answer = false;
  else if (newton_finish_enabled_ && step < negligible * accuracy_)
    answer = true;
  if (answer) error_ = safety * step;
  return answer;
}

bool Minimizer::near_enough(Vec displacement, Vec gradient, double largest_force) {
  if (largest_force == 0) {
    error_ = distance_without_force(displacement);
    return error_ == 0;
  }
  if (accuracy_ == 0) return false;
  if (!worth_estimating(largest_force)) {
    error_ = largest_force / softest_;
    return false;
  }
  if (const auto answer = near_enough_at_a_step(gradient)) return *answer;
  estimated_at_ = function_.evaluations();
  error_ = strict_estimate(displacement, gradient, false);
  if (std::isfinite(error_))
    softest_ = largest_force / error_;
  else
    softest_ = 2 * std::max(softest_, largest_force / accuracy_);
  newton_finish_ = newton_finish_allowed_ && error_ > accuracy_ && error_ <= farthest_correction();
  return error_ <= accuracy_ || newton_finish_;
}

double Minimizer::farthest_correction() const {
  constexpr double finest = 1e-3;  // mm
  return std::max(finest, 10 * accuracy_);
}

bool Minimizer::stalled(int64_t iteration, double value) {
  constexpr int64_t patience = 20;
  constexpr double rounding = 1e-14;  // of the value
  if (iteration == 0 || value < lowest_ - rounding * std::abs(lowest_)) {
    lowest_ = value;
    lowered_at_ = iteration;
  }
  stalled_ = iteration - lowered_at_ >= patience;
  return stalled_;
}

int Minimizer::polish(Vec displacement) {
  constexpr int maximum = 8;
  int corrections = 0;
  while (corrections < maximum && error_ > accuracy_ && error_ <= farthest_correction()) {
    const double before = error_;
    check(VecCopy(displacement, saved_));
    check(VecAXPY(displacement, -1.0, newton_estimate_.step()));
    taken_ = discrete::largest_block(newton_estimate_.step());
    measure(displacement, true);
    taken_ = 0;
    if (error_ > 0.5 * before) {
      check(VecCopy(saved_, displacement));
      measure(displacement, true);
      break;
    }
    ++corrections;
  }
  return corrections;
}

double Minimizer::measure(Vec displacement, bool last) {
  const double objective = function_.evaluate(displacement, gradient_);
  error_ = discrete::largest_block(gradient_) == 0 ? distance_without_force(displacement)
                                                   : strict_estimate(displacement, gradient_, last);
  return objective;
}

std::string Minimizer::reason_of(const Outcome& outcome, TaoConvergedReason reason) const {
  if (stopped_ && (!outcome.converged || function_.positions().load() < 1)) return stopped_reason;
  if (outcome.converged) return reason_text(TAO_CONVERGED_USER);
  return stalled_ ? "the objective no longer decreases beyond rounding" : reason_text(reason);
}

std::string Minimizer::no_progress(Vec displacement) {
  function_.positions().update(displacement);
  const Vec3 at = place_of_largest(function_.positions(), gradient_);
  return fmt::format(
      "no progress in {} evaluations: the largest force stays at {:.3g} N, now near {:.1f} mm",
      ProgressTest::patience, progress_->smallest_force(), at);
}

Outcome Minimizer::summary(Vec displacement) {
  measure(displacement, !newton_finish_);
  taken_ = 0;
  const int corrections = polish(displacement);
  Outcome outcome;
  outcome.objective = function_.evaluate(displacement, gradient_);
  outcome.gradient_max = discrete::largest_block(gradient_);
  outcome.displacement_error = error_;
  outcome.stable = std::isfinite(error_) || !newton_estimate_.negative_curvature();
  outcome.converged = error_ <= accuracy_;
  TaoConvergedReason reason = TAO_CONTINUE_ITERATING;
  check(TaoGetConvergedReason(tao_, &reason));
  outcome.iterations = iterations_ + corrections;
  outcome.stopped = stopped_;
  outcome.reason = reason_of(outcome, reason);
  if (!outcome.converged && !outcome.stopped && progress_->stalled())
    outcome.reason = no_progress(displacement);
  if (corrections > 0)
    outcome.reason += fmt::format(", {} Newton corrections at the rounding level", corrections);
  if (!outcome.stable)
    outcome.reason += ", at a point that is not a minimum";
  else if (!std::isfinite(error_))
    outcome.reason += ", where stiffnesses lie too far apart to estimate the distance to rest";
  return outcome;
}

bool Minimizer::should_restart(int64_t iterations) {
  PetscInt maximum = 0;
  TaoConvergedReason reason = TAO_CONTINUE_ITERATING;
  check(TaoGetMaximumIterations(tao_, &maximum));
  check(TaoGetConvergedReason(tao_, &reason));
  if (!initial_ || iterations_ >= maximum) return false;
  // The iteration in which a line search fails counts too.
  return slowed_ || (reason == TAO_DIVERGED_LS_FAILURE && iterations > 1);
}

Outcome Minimizer::search(Vec displacement, double accuracy, Test test, bool near) {
  accuracy_ = accuracy;
  presolving_ = test == Test::gradient;
  thrown_ = nullptr;
  stopped_ = false;
  iterations_ = 0;
  check(TaoSetSolution(tao_, displacement));
  progress_->begin();
  PetscInt iterations = 0;
  do {
    if (initial_ && near && !slowed_)
      initial_->refresh(displacement);
    else if (initial_)
      initial_->renew(displacement);
    slowed_ = near = false;
    const PetscErrorCode code = TaoSolve(tao_);
    if (thrown_) std::rethrow_exception(thrown_);
    check(code);
    check(TaoGetIterationNumber(tao_, &iterations));
    iterations_ += iterations;
  } while (should_restart(iterations));
  Outcome outcome;
  outcome.stopped = stopped_;
  outcome.iterations = iterations_;
  return outcome;
}

Outcome Minimizer::presolve(Vec displacement, double distance, bool near) {
  if (!initial_) return run(displacement, distance);
  return search(displacement, distance, Test::gradient, near);
}

Outcome Minimizer::finish(Vec displacement, double accuracy, double taken) {
  accuracy_ = accuracy;
  thrown_ = nullptr;
  stopped_ = newton_finish_ = false;
  iterations_ = 0;
  taken_ = taken;
  return summary(displacement);
}

Outcome Minimizer::run(Vec displacement, double accuracy) {
  constexpr int max_left = 20;  // saddles
  Outcome outcome = search_and_finish(displacement, accuracy);
  const auto leaves = [&] {
    return &estimate_.function == &function_ && !outcome.stable && !outcome.stopped &&
           leave_saddle(function_, solver_, displacement);
  };
  for (int n = 0; n < max_left && leaves(); ++n) {
    const int64_t iterations = outcome.iterations;
    outcome = search_and_finish(displacement, accuracy);
    outcome.iterations += iterations;
  }
  return outcome;
}

Outcome Minimizer::search_and_finish(Vec displacement, double accuracy) {
  newton_finish_allowed_ = newton_finish_enabled_;
  newton_finish_ = false;
  search(displacement, accuracy, Test::distance);
  Outcome outcome = summary(displacement);
  if (!newton_finish_ || outcome.converged || outcome.stopped) return outcome;
  // Newton steps do not end it: it continues where they led.
  newton_finish_allowed_ = newton_finish_ = false;
  const int64_t iterations = outcome.iterations;
  search(displacement, accuracy, Test::distance);
  outcome = summary(displacement);
  outcome.iterations += iterations;
  return outcome;
}

}  // namespace repose::solve
