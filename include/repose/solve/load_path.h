#pragma once
#include <functional>
#include <optional>

#include "repose/model/step.h"
#include "repose/solve/predictor.h"
#include "repose/solve/rest_search.h"

namespace repose::solve {

/// How the bones are taken to their places.
struct PathSettings {
  double accuracy = 0.1;       ///< mm, of every step
  int load_steps = 0;          ///< equal steps; 0: as many as the motion needs
  double longest_stride = 10;  ///< mm of the fastest point in one automatic step, at most
  double start_load = 0;       ///< of a restarted run
  bool hasty = false;          ///< a short step is halved where it fails or folds tissue only
};

/// What a run came to.
struct PathOutcome {
  Outcome last;
  double load = 0;    ///< reached
  int64_t steps = 0;  ///< accepted
  int64_t halvings = 0;
  int64_t iterations = 0;
  bool leapt = false;  ///< it came from a guess, not along the path
  int64_t softer = 0;  ///< evaluations with softer volume terms before (stiffening.h)
  bool complete() const { return last.converged && load == 1; }
};

/// Follows the rest position from the initial state as the bones move: each step starts from a
/// linear prediction, and one that fails, folds tissue or lands far from its prediction is halved.
/// A long step must also agree with the prediction back from its end, or it may have passed over a
/// jump of the rest position. All members collective.
class LoadPath {
 public:
  using OnStep = std::function<void(const Outcome&, double load, double seconds)>;

  LoadPath(discrete::Objective& objective, Predictor& predictor, RestSearch& search,
           const PathSettings& settings);

  /// From `displacement` (changed in place, the start of a restarted run) to load 1. `on_step` is
  /// called with the positions at each accepted step, and at the last one if it failed. A `guess`
  /// of the rest position at load 1, if not null, is tried before the path is followed, and is
  /// good where the search from it comes to rest without folded tissue.
  PathOutcome run(Vec displacement, Vec guess, const OnStep& on_step);

  /// Automatic steps are long where the fastest point goes farther, mm.
  static constexpr double short_stride = 2.5;
  /// Of a solid, whose searches end at one rest position from as far, mm.
  static constexpr double solid_stride = 20;

 private:
  struct Attempt {
    Outcome outcome;
    bool folded = false;  // more inverted prisms than at the start of the step
    double expected = 0;  // largest predicted displacement, mm
    double miss = 0;      // largest distance of the end from the prediction, mm
    double defect = 0;    // of a long step: its largest distance from the mean of both predictions
  };
  double step_of(double stride) const;
  double longest_step() const;
  bool is_long(double step) const { return step > 1.01 * short_step_; }
  int64_t inverted(Vec displacement);
  Attempt attempt(Vec displacement, double load);
  double defect(Vec displacement, double before);
  bool follows(const Attempt& now, bool is_long, const Attempt* coarser) const;
  void settle(Vec displacement, const OnStep& on_step);
  void leap(Vec displacement, Vec guess, const OnStep& on_step);
  void accept(const Outcome& outcome, double load, Vec displacement);

  discrete::Objective& objective_;
  Predictor& predictor_;
  RestSearch& search_;
  PathSettings settings_;
  double short_step_ = 1;  // the longest that is not long
  base::VecHandle trial_, increment_;
  PathOutcome result_;
};

}  // namespace repose::solve
