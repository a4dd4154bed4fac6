#pragma once
#include <vector>

#include "repose/solve/load_path.h"
#include "repose/solve/problem.h"

namespace repose::solve {

/// Leads to the rest position at load 1 where the volume term is stiff. A linear prediction keeps
/// volumes to first order only; what it misses by, times a large κ, throws a search far back. So
/// the bones are followed with a κ of 10 times the tissue's effective modulus, and κ grows from
/// rest position to rest position, where the bones stay (docs/measurements/stiff_volume.md). All
/// members collective.
class Stiffening {
 public:
  Stiffening(Problem& problem, Predictor& predictor, RestSearch& search);

  /// Whether the objective's κ is stiff, and not so stiff that the way along κ leads elsewhere.
  bool pays() const { return weight_.size() > 1; }

  /// From the rest position at load 0 to a guess of that at load 1, in place; the objective's κ is
  /// what it was and the positions are at load 0 again. Returns whether the bones were followed to
  /// load 1 and the searches there came to rest, or were stopped.
  bool run(Vec displacement, PathSettings settings);

 private:
  void set_weight(double weight);
  bool stiffen(Vec displacement, double accuracy);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  Predictor& predictor_;
  RestSearch& search_;
  std::vector<double> weight_;  // of the volume term, softest first, the objective's own last
};

/// LoadPath::run with what suits the problem: short steps only where long ones cost more, and where
/// no guess is given, one by stiffening where it pays, whose time is the first step's. The weights
/// of an exact volume are its search's own. Collective.
PathOutcome follow_bones(Problem& problem, RestSearch& search, bool exact_volume,
                         PathSettings settings, Vec displacement, Vec guess,
                         const LoadPath::OnStep& on_step);

}  // namespace repose::solve
