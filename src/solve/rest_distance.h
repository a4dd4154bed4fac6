#pragma once
#include "repose/solve/minimizer.h"

namespace repose::solve {

/// Estimates how far a state is from rest by Newton steps (docs/theory/error_estimate.md). All
/// members collective.
class RestDistance {
 public:
  /// `minimized` is the function that a search minimizes; the Newton steps may be of another one
  /// with the same rest position.
  RestDistance(const discrete::Function& minimized, const ErrorEstimate& estimate);

  /// State of a search.
  struct State {
    Vec displacement, gradient;  ///< the gradient of the function that is minimized
    bool last = false;           ///< the search ends here: the estimate is reported
    double taken = 0;            ///< mm, the full Newton step that led here, or 0
  };
  /// Returns the estimate, mm, with a bound on the error of the linear system where it is the last
  /// or seems within `accuracy`. Infinite where H is not positive definite; where no force is left,
  /// 0 or, at a saddle, infinite.
  double estimate(const State& at, double accuracy);
  static constexpr double safety = 2;  ///< the estimate is this many Newton steps long
  /// Returns the preconditioned gradient's largest block, mm: 0 where there is no preconditioner
  /// yet, nothing where it is another function's.
  std::optional<double> preconditioned_step(Vec gradient);

  bool of_minimized() const { return of_minimized_; }  ///< the steps are
  Vec step() const { return newton_.step(); }          ///< H⁻¹ ∇Φ of the latest estimate
  /// Returns whether the latest estimate met negative curvature.
  bool negative_curvature() const { return newton_.negative_curvature(); }

 private:
  double contraction(Vec displacement);

  ErrorEstimate of_;
  bool of_minimized_;
  linear::NewtonEstimate newton_;  // by the same solver
  double contraction_ = 0;         // of the latest Newton step, …
  int64_t contracted_at_ = -1;     // … at this many assemblies of the Hessian
  base::VecHandle trial_, gradient_;
};

}  // namespace repose::solve
