#pragma once
#include <petscksp.h>

#include <algorithm>

namespace repose::linear {

/// Measures the cost of a preconditioner made at an earlier state: the iterations that its
/// solves took beyond what the same reductions of the residual took when it was new. Renewed when
/// that exceeds the price of a new one, total work is at most about twice that of the best times
/// of renewal, whichever these are (the ski-rental rule: Karlin, Manasse, Rudolph & Sleator 1988).
/// One with which a solve failed or was cut short is worn out.
class LagPolicy {
 public:
  explicit LagPolicy(double price) : price_(price) {}  ///< of a renewal, in iterations

  /// Returns whether a new one is worth its price.
  bool should_rebuild() const { return spent_ > price_; }
  /// Returns whether a new one was too slow, given enough iterations: a solve near a state where
  /// the stiffness is singular is slow with any preconditioner.
  bool stagnates() const {
    constexpr double slowest = 15;  // iterations per e-fold
    constexpr double proof = 300;   // iterations
    return new_iterations_ > proof && new_rate() > slowest;
  }
  void renew();  ///< a new one is made at the state
  void move();   ///< the state changes
  /// Takes in a solve just ended, whose residual history was recorded. The same on all ranks.
  void observe(KSP krylov);

 private:
  /// Iterations per e-fold of the residual when it was new, at least 1.
  double new_rate() const { return std::max(1.0, new_iterations_ / std::max(1.0, folds_)); }

  double price_;
  bool new_ = true;                        // at the state it was made at
  double spent_ = 0;                       // iterations beyond those of a new one
  double new_iterations_ = 0, folds_ = 0;  // when new, and the e-folds they took the residual down
};

}  // namespace repose::linear
