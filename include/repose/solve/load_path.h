#pragma once
#include <functional>
#include <optional>

#include "repose/discrete/objective.h"
#include "repose/linear/tangent_solver.h"
#include "repose/solve/problem.h"
#include "repose/solve/rest_search.h"

namespace repose::solve {

/// Predicts the motion of the unknowns, to first order, when the fixed points move on: −H⁻¹ H_sb
/// Δx_b.
class Predictor {
 public:
  Predictor(discrete::Objective& objective, linear::TangentSolver& solver);

  /// The increment from `displacement` at the positions' load to `load`. Returns false where the
  /// Hessian is indefinite or the linear solver does not converge. Collective.
  bool predict(Vec displacement, double load, Vec increment);

 private:
  discrete::Objective& objective_;
  linear::TangentSolver& solver_;
  base::VecHandle force_;
};

/// Settings of the load path.
struct PathSettings {
  double accuracy = 0.1;    ///< mm, of every step
  int load_steps = 0;       ///< equal steps; 0: as many as the motion needs
  double start_load = 0;    ///< of a restarted run
  bool near_guess = false;  ///< the guess is tried before anything else, as near to rest
  bool ends_along = false;  ///< the last of `load_steps` steps ends the path with contact, too
};

/// Load steps that were made again in two parts, by the reason.
struct Halvings {
  int64_t failed = 0;          ///< the search did not converge
  int64_t folded = 0;          ///< more tissue was inside out
  int64_t off_prediction = 0;  ///< it ended far from the prediction
  int64_t count() const { return failed + folded + off_prediction; }
};

/// Outcome of a load path.
struct PathOutcome {
  Outcome last;
  double load = 0;    ///< reached
  int64_t steps = 0;  ///< accepted, without the state at which the path begins
  Halvings halvings;
  int64_t iterations = 0;
  bool leapt = false;  ///< it came from a guess, not along the path
  bool complete() const { return last.converged && load == 1; }
};

/// Continuation along the bones' motion, with one step controller: predict to first order, solve,
/// accept, or halve where the search fails, folds tissue or ends far from the prediction. It gives
/// up where steps have been halved to the end, or where most evaluations go into steps that are
/// made again. With contact, load 1 is reached from load 0 in automatic steps, whatever steps are
/// requested in between: where several rest positions exist, the requested steps do not choose.
/// All members collective.
class LoadPath {
 public:
  using OnStep = std::function<void(const Outcome&, double load, double seconds)>;

  LoadPath(Problem& problem, RestSearch& search, const PathSettings& settings);

  /// From `displacement` (changed in place, the start of a restarted run) to load 1. `on_step` is
  /// called with the positions at each accepted step, and at the last one if it failed. A `guess`
  /// of the rest position at load 1, if not null, is tried before the path is followed, and is
  /// good where the search from it comes to rest without folded tissue.
  PathOutcome run(Vec displacement, Vec guess, const OnStep& on_step);

 private:
  struct Attempt {
    discrete::ContactPressures before;  // of the step
    int64_t begun = 0;                  // evaluations before it
    int64_t inverted = 0;               // prisms, before it
    bool predicted = false;             // trial_ began at the predicted end, increment_
    double expected = 0;                // mm, largest predicted displacement
    Outcome outcome = {};
    int64_t evaluations = 0;  // of the step
    bool folded = false;      // more prisms are inverted than before
    double miss = 0;          // mm, largest distance of the end from the prediction
  };
  double automatic_step() const;
  double requested_step() const;
  bool ends_in_automatic_steps() const;
  int64_t inverted(Vec displacement);
  Attempt begin_step(Vec displacement, double load);
  void end_step(Attempt& step);
  bool predict(Vec displacement, double load);
  bool begins_softer() const;
  void presolve_softer();
  bool follows(const Attempt& now, const std::optional<Attempt>& coarser) const;
  void settle(Vec displacement, const OnStep& on_step);
  void follow(Vec displacement, double longest, double end, const OnStep& on_step);
  void follow_again(Vec start, Vec displacement, const OnStep& on_step);
  void try_guess(Vec displacement, Vec guess, const OnStep& on_step);
  void accept(const Outcome& outcome, double load, Vec displacement);
  void reject_step(const Attempt& tried);
  bool in_vain(const Attempt& tried) const;
  void refuse_end();
  void explain_failure();

  Problem& problem_;
  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  const discrete::Function& function_;
  Predictor predictor_;
  RestSearch& search_;
  PathSettings settings_;
  base::VecHandle trial_, increment_;
  PathOutcome result_;
  int64_t begun_ = 0;    // evaluations before this path
  int64_t refused_ = 0;  // evaluations of steps that were made again
};

}  // namespace repose::solve
