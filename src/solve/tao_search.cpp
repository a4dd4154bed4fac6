#include "tao_search.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "repose/base/petsc.h"
#include "repose/solve/supported.h"

namespace repose::solve {

using base::check;

namespace {

// Newton's linear systems are solved to this much of their right-hand side: roughly far from the
// rest position, closely near it (superlinear: Dembo, Eisenstat & Steihaug 1982).
constexpr double coarsest_forcing = 0.1, finest_forcing = 1e-3;

bool uses_hessian(Tao tao) {
  return base::has_type(tao, TAONLS, TAONTR, TAONTL, TAOBNLS, TAOBNTR, TAOBNTL);
}

std::string reason_text(TaoConvergedReason reason) {
  switch (reason) {
    case TAO_CONVERGED_USER:
      return "the distance to rest that is estimated in the end exceeds the accuracy";
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

/// The C functions TAO calls.
struct TaoSearch::Callbacks {
  template <class Work>
  static PetscErrorCode call(void* me, Work&& work) {
    return base::run_callback([&] { work(*static_cast<TaoSearch*>(me)); });
  }

  static PetscErrorCode value_and_gradient(Tao, Vec x, PetscReal* value, Vec gradient, void* me) {
    return call(me, [&](TaoSearch& self) { *value = self.function_.evaluate(x, gradient); });
  }

  /// TAO's own way to the value alone leaves its vector behind where an evaluation fails.
  static PetscErrorCode value(Tao, Vec x, PetscReal* value, void* me) {
    return call(me, [&](TaoSearch& self) { *value = self.function_.evaluate(x, self.gradient_); });
  }

  static PetscErrorCode hessian(Tao, Vec x, Mat, Mat, void* me) {
    return call(me, [&](TaoSearch& self) {
      self.solver_.prepare(x);
      self.set_forcing();
    });
  }

  static PetscErrorCode converged(Tao tao, void* me) {
    return call(me, [&](TaoSearch& self) {
      PetscInt iteration = 0;
      PetscReal value = 0, length = 0;
      check(TaoGetSolutionStatus(tao, &iteration, &value, nullptr, nullptr, &length, nullptr));
      StoppingTest::Iterate state;
      state.cut = iteration > 0 && self.method() == Method::newton && self.step_was_cut();
      check(TaoGetSolution(tao, &state.displacement));
      check(TaoGetGradient(tao, &state.gradient, nullptr, nullptr));
      state.largest_force = discrete::largest_block(state.gradient);
      iteration += self.before_;
      self.latest_force_ = state.largest_force;
      if (iteration == 0) self.first_force_ = state.largest_force;
      const bool ends = self.ends_({iteration, value, state});
      check(TaoDefaultConvergenceTest(tao, nullptr));
      self.slowed_ =
          !ends && self.initial_ && self.initial_->needs_renewal(state.largest_force, length);
      if (ends || self.slowed_) check(TaoSetConvergedReason(tao, TAO_CONVERGED_USER));
    });
  }
};

TaoSearch::TaoSearch(discrete::Function& function, linear::TangentSolver& solver, TaoType type)
    : function_(function), solver_(solver), gradient_(function.positions().make_vector()) {
  require_supported_options();
  check(TaoCreate(function_.positions().comm(), tao_.out()));
  check(TaoSetType(tao_, type));
  check(TaoSetObjective(tao_, Callbacks::value, this));
  check(TaoSetObjectiveAndGradient(tao_, nullptr, Callbacks::value_and_gradient, this));
  check(TaoSetHessian(tao_, solver_.hessian().model(), solver_.preconditioner().matrix(),
                      Callbacks::hessian, this));
  check(TaoSetTolerances(tao_, 0, 0, 0));
  check(TaoSetMaximumIterations(tao_, 5000));
  check(TaoSetMaximumFunctionEvaluations(tao_, 100000));
  check(TaoSetConvergenceTest(tao_, Callbacks::converged, this));
  base::check_options(TaoSetFromOptions(tao_));
  if (base::has_type<Tao>(tao_, TAOLMVM) && begins_with_stiffness(function_.positions()))
    initial_ = std::make_unique<InitialHessian>(tao_, solver_);
  if (method() == Method::newton) make_forcing();
}

bool TaoSearch::is_chosen() {
  PetscBool chosen = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, "-tao_type", &chosen));
  return chosen;
}

void TaoSearch::make_forcing() {
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
  sets_forcing_ = !given;
}

void TaoSearch::set_forcing() {
  if (!sets_forcing_ || first_force_ == 0) return;
  KSP inner = nullptr;
  check(TaoGetKSP(tao_, &inner));
  const double forcing =
      std::clamp(std::sqrt(latest_force_ / first_force_), finest_forcing, coarsest_forcing);
  check(KSPSetTolerances(inner, forcing, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
}

bool TaoSearch::step_was_cut() const {
  KSP inner = nullptr;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(TaoGetKSP(tao_, &inner));
  check(KSPGetConvergedReason(inner, &reason));
  return reason != KSP_CONVERGED_RTOL && reason != KSP_CONVERGED_ATOL &&
         reason != KSP_CONVERGED_ITS && reason != KSP_DIVERGED_ITS;
}

Method TaoSearch::method() const {
  if (uses_hessian(tao_)) return Method::newton;
  return initial_ ? Method::preconditioned : Method::gradient;
}

std::string TaoSearch::reason() const {
  TaoConvergedReason reason = TAO_CONTINUE_ITERATING;
  check(TaoGetConvergedReason(tao_, &reason));
  return reason_text(reason);
}

/// Returns whether a search that ended after `iterations` begins again where it ended.
bool TaoSearch::should_restart(int64_t iterations) const {
  PetscInt maximum = 0;
  TaoConvergedReason reason = TAO_CONTINUE_ITERATING;
  check(TaoGetMaximumIterations(tao_, &maximum));
  check(TaoGetConvergedReason(tao_, &reason));
  if (!initial_ || before_ >= maximum) return false;
  // The iteration in which a line search fails counts too.
  return slowed_ || (reason == TAO_DIVERGED_LS_FAILURE && iterations > 1);
}

int64_t TaoSearch::run(Vec displacement, Ends ends) {
  ends_ = std::move(ends);
  before_ = 0;
  check(TaoSetSolution(tao_, displacement));
  PetscInt iterations = 0;
  do {
    if (initial_) initial_->renew(displacement);
    slowed_ = false;
    check(TaoSolve(tao_));
    check(TaoGetIterationNumber(tao_, &iterations));
    before_ += iterations;
  } while (should_restart(iterations));
  return before_;
}

}  // namespace repose::solve
