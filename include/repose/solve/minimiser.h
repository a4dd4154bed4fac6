#pragma once
#include <petsctao.h>

#include <exception>
#include <functional>
#include <memory>
#include <string>

#include "repose/solve/tangent_solver.h"

namespace repose::solve {

using TaoHandle = base::Handle<Tao, TaoDestroy>;

/// What a person watching wants to know after each iteration.
struct Iteration {
  int64_t number = 0;
  double load = 0;
  double objective = 0;
  double largest_force = 0;      ///< largest block of ∇Φ
  double millimetres_to_go = 0;  ///< estimated distance to the rest position
};

/// How a minimisation ended.
struct Outcome {
  bool converged = false;         ///< the estimated distance is below the accuracy asked for
  bool stable = false;            ///< no negative curvature was met at the end
  double displacement_error = 0;  ///< mm, estimate of the largest distance to the rest position
  double objective = 0;
  double gradient_max = 0;  ///< N
  int64_t iterations = 0;
  std::string reason;
};

/// Minimises an objective with TAO until the rest position is near enough, in mm. Newton by
/// default;
/// `-tao_type` chooses any unconstrained TAO method, and all `-tao_…`, `-ksp_…`, `-pc_…` options
/// apply. All members collective.
class Minimiser {
 public:
  Minimiser(Objective& objective, std::function<void(const Iteration&)> watch);

  /// From `displacement` (changed in place) at the positions' load.
  Outcome run(Vec displacement, double accuracy);

  /// The linear prediction of how unknowns move when fixed points go from the positions' load to
  /// `load`: −H⁻¹ H_sb Δx_b at `displacement`. Returns false where the Hessian is indefinite.
  bool predict(Vec displacement, double load, Vec increment);

  int64_t assemblies() { return solver_.tangent().assemblies(); }  ///< not collective

 private:
  struct Callbacks;
  void make_tao();
  void set_forcing();
  double strict_estimate(Vec displacement, Vec gradient);
  bool near_enough(Vec displacement, Vec gradient, double largest_force);
  double measure(Vec displacement);
  int polish(Vec displacement);
  Outcome summary(Vec displacement);

  Objective& objective_;
  TangentSolver solver_;
  std::function<void(const Iteration&)> watch_;
  TaoHandle tao_;
  bool newton_ = true;  // the TAO method uses the Hessian
  bool automatic_forcing_ = true;
  double first_force_ = 0, force_ = 0;  // N, largest block of ∇Φ at the first and latest iterate
  double accuracy_ = 0;                 // mm, of the run under way
  double error_ = 0;                    // mm, latest strict estimate
  double softest_ = 0;                  // N/mm: force over distance at the last strict estimate
  base::VecHandle gradient_, saved_;
  std::exception_ptr thrown_;
};

}  // namespace repose::solve
