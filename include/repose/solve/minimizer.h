#pragma once
#include <petsctao.h>

#include <exception>
#include <functional>
#include <memory>
#include <optional>

#include "repose/linear/newton_estimate.h"
#include "repose/solve/rest_search.h"

namespace repose::solve {

class InitialHessian;
class ProgressTest;

using TaoHandle = base::Handle<Tao, TaoDestroy>;

/// Estimates how far a state is from rest by the Newton step of `function`, whose linear systems
/// `solver` solves.
struct ErrorEstimate {
  discrete::Function& function;
  linear::TangentSolver& solver;
};

/// Minimizes a function with TAO until the rest position is near enough, in mm. Newton by default;
/// `-tao_type` chooses any unconstrained TAO method, and all `-tao_…`, `-ksp_…`, `-pc_…` options
/// apply. `-tao_type lmvm -tao_lmvm_initial stiffness` is limited-memory BFGS that begins with the
/// stiffness at the start of the search, and again where it has slowed (initial_hessian.h). All
/// members collective.
class Minimizer : public RestSearch {
 public:
  /// Receives each iteration; returns whether to continue, the same on all ranks.
  using Watch = std::function<bool(const Iteration&)>;
  /// `solver` is for Newton methods; the distance to the rest position is its Newton step too, or
  /// that of another function with the same rest position.
  Minimizer(discrete::Function& function, linear::TangentSolver& solver, const Watch& watch);
  Minimizer(discrete::Function& function, linear::TangentSolver& solver,
            const ErrorEstimate& estimate, const Watch& watch);
  ~Minimizer() override;

  /// Searches until the preconditioned gradient, where there is one, is about `distance` mm long:
  /// no estimate of the distance is made sure. Returns the iterations and whether it was stopped.
  /// `near`: the search begins where the last one ended, but for contact.
  Outcome presolve(Vec displacement, double distance, bool near);
  int64_t presolve_within(Vec displacement, double distance) override {
    return presolve(displacement, distance, false).iterations;
  }

  /// Estimates the distance to the rest position and ends the search by Newton steps, where these
  /// are short enough; no search of TAO's. `taken`, mm: the full Newton step that led here, or 0.
  Outcome finish(Vec displacement, double accuracy, double taken = 0);

  /// With accuracy 0 the distance is not estimated during the search: TAO goes on as long as it
  /// can. A saddle is left along the mode of least curvature, and searched from again.
  Outcome run(Vec displacement, double accuracy) override;

 private:
  struct Callbacks;
  void make_tao();
  void set_forcing();
  /// The criterion that ends a search: the estimated distance to rest, or the preconditioned
  /// gradient alone.
  enum class Test { distance, gradient };
  /// Calls TAO. Returns the iterations and whether it was stopped; `near` as presolve().
  Outcome search(Vec displacement, double accuracy, Test test, bool near = false);
  Outcome search_and_finish(Vec displacement, double accuracy);
  /// Returns whether the search that ended after `iterations` begins again where it ended.
  bool should_restart(int64_t iterations);
  /// `last`: the search is over, so the estimate is reported.
  double strict_estimate(Vec displacement, Vec gradient, bool last);
  /// Returns θ (NewtonEstimate) of the latest Newton step δ, from `displacement`, and the next,
  /// where the rest is |δ| / (1 − θ) away at most where Newton's method converges (Deuflhard 2004,
  /// Newton Methods for Nonlinear Problems, 2.1); as good as 1 where θ is large or the quadratic
  /// model misleads.
  double contraction(Vec displacement);
  bool step_was_cut() const;
  /// Where no force is left: 0, or infinite at a saddle.
  double distance_without_force(Vec displacement);
  bool worth_estimating(double largest_force) const;
  std::optional<bool> near_enough_at_a_step(Vec gradient);
  bool near_enough(Vec displacement, Vec gradient, double largest_force);
  double farthest_correction() const;  ///< mm, of a Newton step that ends a search
  bool stalled(int64_t iteration, double value);
  double measure(Vec displacement, bool last);
  int polish(Vec displacement);
  std::string reason_of(const Outcome& outcome, TaoConvergedReason reason) const;
  /// Why the search stalls and where. Collective.
  std::string no_progress(Vec displacement);
  Outcome summary(Vec displacement);

  discrete::Function& function_;
  linear::TangentSolver& solver_;
  ErrorEstimate estimate_;
  linear::NewtonEstimate newton_estimate_;  // by the same solver
  Watch watch_;
  std::unique_ptr<ProgressTest> progress_;
  TaoHandle tao_;
  std::unique_ptr<InitialHessian> initial_;  // of limited-memory BFGS, where it is requested
  bool newton_finish_allowed_ = false;       // … in the present search
  bool newton_finish_ = false;               // it did
  bool newton_finish_enabled_ = false;       // near rest its search is finished by Newton steps
  bool newton_ = true;                       // the TAO method uses the Hessian
  bool slowed_ = false;                      // the initial Hessian is to be renewed
  int64_t iterations_ = 0;                   // of the present run, before TAO's present ones
  bool automatic_forcing_ = true;
  bool cut_ = false;                    // the latest Newton step was
  double first_force_ = 0, force_ = 0;  // N, largest block of ∇Φ at the first and latest iterate
  double accuracy_ = 0;                 // mm, of the present run
  double error_ = 0;                    // mm, latest strict estimate
  double softest_ = 0;                  // N/mm: force over distance at the last strict estimate
  int64_t estimated_at_ = 0;            // evaluations at that estimate
  double lowest_ = 0;                   // value, of the present run
  int64_t lowered_at_ = 0;              // iteration at which it was found
  bool stalled_ = false;                // the value has not fallen for long
  bool presolving_ = false;             // the present search is a presolve
  bool stopped_ = false;                // the watcher stopped the search
  double taken_ = 0;                    // mm, the Newton step that led here, or 0
  double contraction_ = 0;              // of the latest Newton step, …
  int64_t contracted_at_ = -1;          // … at this many assemblies of the Hessian
  base::VecHandle gradient_, saved_, trial_, estimate_gradient_;
  std::exception_ptr thrown_;
};

}  // namespace repose::solve
