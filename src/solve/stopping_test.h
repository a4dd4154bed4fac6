#pragma once
#include "rest_distance.h"

namespace repose::solve {

/// Methods of search, by the measure of the distance to rest that an iteration gives.
enum class Method {
  newton,          ///< its steps are Newton steps
  preconditioned,  ///< limited-memory BFGS that begins with the preconditioner
  gradient,        ///< by gradients alone
};

/// Ends a search where the rest position is near enough. An estimate costs the solution of a linear
/// system, so it is made only where the preconditioned gradient, or the force that went with a
/// distance at the last estimate, says that it is worth it.
class StoppingTest {
 public:
  /// `finishes`: near rest a search is to be finished by Newton steps.
  StoppingTest(const discrete::Function& function, RestDistance& distance, Method method,
               bool finishes)
      : function_(function), distance_(distance), method_(method), finishes_(finishes) {}

  /// Criterion that ends a search: the estimated distance to rest, or the preconditioned gradient
  /// alone.
  enum class Criterion { distance, gradient };
  /// Begins a search to `accuracy` mm; with 0 it goes on as long as it can. `may_finish`: it may
  /// end where Newton steps finish it.
  void begin(double accuracy, Criterion criterion, bool may_finish);

  /// Iterate of a search.
  struct Iterate {
    Vec displacement, gradient;
    double largest_force = 0;  ///< N, largest block of the gradient
    bool cut = false;          ///< a trust region or negative curvature cut its Newton step off
  };
  /// Returns whether the search ends here. Collective.
  bool ends(const Iterate& at);

  double error() const { return error_; }             ///< mm, the latest estimate, rough or strict
  bool left_to_finish() const { return finishing_; }  ///< the search ended for Newton steps

 private:
  bool worth_estimating(const Iterate& at) const;
  std::optional<bool> ends_at_preconditioned_step(Vec gradient);

  const discrete::Function& function_;
  RestDistance& distance_;
  Method method_;
  bool finishes_;
  double accuracy_ = 0;  // mm, of the present search
  Criterion criterion_ = Criterion::distance;
  bool may_finish_ = false, finishing_ = false;
  double error_ = 0;
  double softest_ = 0;        // N/mm: force over distance at the last strict estimate
  int64_t estimated_at_ = 0;  // evaluations at that estimate
};

/// Returns the longest Newton step, mm, that may finish a search to `accuracy`.
double farthest_correction(double accuracy);

}  // namespace repose::solve
