#pragma once
#include <petsctao.h>

#include "repose/linear/tangent_solver.h"

namespace repose::solve {

/// Slowdown of a quasi-Newton search since its initial Hessian was made, in
/// iterations: what the line searches cut off the full steps, and what went beyond the iterations
/// that the same reduction of the force takes at the best rate seen since. Renewed when that
/// exceeds the price of a new one, as LagPolicy (lag_policy.h).
class StepLag {
 public:
  explicit StepLag(double price) : price_(price) {}  ///< of a renewal, in iterations
  void renew();                                      ///< a new one is made at the state
  /// Takes in an iterate: its largest force, N, and how long its step was, 1 being a full one.
  /// Returns whether a new initial Hessian is worth its price. The same on all ranks.
  bool observe(double force, double length);

 private:
  double price_;
  double first_force_ = 0;      // N, where it was made; 0: not known yet
  double steps_ = 0, cut_ = 0;  // since then, and what was cut off them
  double best_rate_ = slowest;  // folds of the force an iteration
  static constexpr double slowest = 0.05;
};

/// The initial inverse Hessian of TAO's limited-memory BFGS (J0; Nocedal & Wright 2006, Numerical
/// Optimization, 7.2): the preconditioner of a tangent solver, made of the convex stiffness at a
/// state of the search. Each step applies it once. `-tao_lmvm_renewal_price`: see StepLag.
class InitialHessian {
 public:
  /// Makes `tao`, of type TAOLMVM, use it. `solver` and this must outlive the solves. Collective.
  InitialHessian(Tao tao, linear::TangentSolver& solver);
  InitialHessian(InitialHessian&&) = delete;

  /// Makes it at `displacement`, unless it was made there. Collective.
  void renew(Vec displacement);
  /// As StepLag::observe.
  bool needs_renewal(double force, double length);

 private:
  static PetscErrorCode apply(Mat matrix, Vec vector, Vec product);

  linear::TangentSolver& solver_;
  base::MatHandle inverse_;  // MATSHELL whose solution is the preconditioner's
  StepLag lag_;
  int64_t renewals_ = 0;  // of the preconditioner, at the last check
};

/// Returns whether limited-memory BFGS is to begin with the stiffness (`-tao_lmvm_initial
/// stiffness`, the default of a solid) or with the diagonal that TAO estimates (`diagonal`, that of
/// springs). Throws InputError. Collective.
bool begins_with_stiffness(const discrete::Positions& positions);

}  // namespace repose::solve
