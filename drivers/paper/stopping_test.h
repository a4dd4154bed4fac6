#pragma once
#include "repose/discrete/function.h"

namespace repose::paper {

/// When a search is over.
struct Rules {
  double accuracy = 0.1;     ///< mm, largest distance from the goal
  int64_t limit = 10000;     ///< evaluations
  double path_seconds = 12;  ///< CPU; for load paths
  double seconds = 3;        ///< CPU; for methods whose evaluations are few and dear
};

/// Thrown by a test to stop a search: near enough, or no evaluation or time left.
struct SearchOver {
  bool reached = false;
};

/// A function that watches the search that minimizes it: throws SearchOver at the first evaluated
/// state within the accuracy of the goal, and at the limits. Its looks are not timed.
class StoppingTest : public discrete::Function {
 public:
  /// `goal` may be null: then the limits alone count.
  StoppingTest(discrete::Function& inner, Vec goal, const Rules& rules);

  double closest() const { return closest_; }  ///< mm, of all states so far
  double seconds() const;                      ///< CPU time since construction

 private:
  double value_and_gradient(Vec displacement, Vec gradient) override;

  discrete::Function& inner_;
  Vec goal_;
  Rules rules_;
  base::VecHandle difference_;
  double closest_;
  double begin_, looking_ = 0;  // s
};

}  // namespace repose::paper
