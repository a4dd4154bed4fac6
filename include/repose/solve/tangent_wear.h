#pragma once
#include <petscksp.h>

namespace repose::solve {

/// How much a preconditioner made at an earlier state has come to cost: the iterations that its
/// solves took beyond what the same reductions of the residual took when it was new. Renewed when
/// that exceeds the price of a new one, total work is at most about twice that of the best times
/// of renewal, whichever these are (the ski-rental rule: Karlin, Manasse, Rudolph & Sleator 1988).
class Wear {
 public:
  /// Whether a new one is worth its price.
  bool out() const { return spent_ > price; }
  /// Iterations per e-fold of the residual when it was new.
  double new_rate() const { return folds_ > 1 ? new_iterations_ / folds_ : 1; }
  void renew();  ///< a new one is made at the state
  void move();   ///< the state changes
  /// Takes in a solve just ended, whose residual history was recorded. The same on all ranks.
  void take(KSP krylov);

 private:
  static constexpr double price = 20;  // of a renewal, in iterations

  bool new_ = true;                        // at the state it was made at
  double spent_ = 0;                       // iterations beyond those of a new one
  double new_iterations_ = 0, folds_ = 0;  // when new, and the e-folds they took the residual down
};

}  // namespace repose::solve
