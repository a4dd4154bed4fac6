#pragma once
#include <petsctao.h>

#include <functional>
#include <memory>

#include "repose/linear/newton_estimate.h"
#include "repose/solve/rest_search.h"

namespace repose::solve {

class NewtonFinish;
class ProgressTest;
class RestDistance;
class StoppingTest;
class TaoSearch;
struct TaoIterate;

/// Estimates how far a state is from rest by the Newton step of `function`, whose linear systems
/// `solver` solves.
struct ErrorEstimate {
  discrete::Function& function;
  linear::TangentSolver& solver;
};

/// Minimizes a function with TAO until the rest position is near enough, in mm. Newton for springs;
/// limited-memory BFGS for a solid, and Newton where that fails; `-tao_type` chooses any
/// unconstrained TAO method, and all `-tao_…`, `-ksp_…`, `-pc_…` options apply. `-tao_type lmvm
/// -tao_lmvm_initial stiffness` is limited-memory BFGS that begins with the stiffness at the start
/// of the search, and again where it has slowed (initial_hessian.h). Its parts: TAO (tao_search.h),
/// the estimated distance to rest (rest_distance.h), the test that ends a search (stopping_test.h)
/// and that of its progress (progress_test.h), and Newton steps at its end (newton_finish.h). All
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
  Outcome presolve(Vec displacement, double distance) override;

  /// Estimates the distance to the rest position and ends the search by Newton steps, where these
  /// are short enough; no search of TAO's. `taken`, mm: the full Newton step that led here, or 0.
  Outcome finish(Vec displacement, double accuracy, double taken = 0);

  /// With accuracy 0 the distance is not estimated during the search: TAO goes on as long as it
  /// can. A saddle is left along the mode of least curvature, and searched from again.
  Outcome run(Vec displacement, double accuracy) override;

 private:
  void search_by(TaoType type);
  std::function<bool(const TaoIterate&)> ending(Outcome& outcome);
  Outcome search_and_finish(Vec displacement, double accuracy);
  Outcome summarize(Vec displacement, double accuracy, Outcome outcome, double taken = 0);
  std::string reason_of(const Outcome& outcome) const;
  std::string no_progress(Vec displacement) const;

  discrete::Function& function_;
  linear::TangentSolver& solver_;
  Watch watch_;
  std::unique_ptr<RestDistance> distance_;
  std::unique_ptr<TaoSearch> tao_;
  std::unique_ptr<StoppingTest> test_;
  std::unique_ptr<ProgressTest> progress_;
  std::unique_ptr<NewtonFinish> finish_;
};

}  // namespace repose::solve
