#pragma once
#include <petscvec.h>

#include <cstdint>
#include <limits>

#include "repose/base/geometry.h"
#include "repose/discrete/positions.h"

namespace repose::solve {

/// Tells a search that converges slowly from one that does not converge: a search stalls when
/// `patience` evaluations have changed neither the smallest of its largest forces, nor its smallest
/// estimated distance to the rest position, nor the decrease of its objective by a tenth. It is at
/// rounding when 20 iterations have not lowered the objective beyond that.
class ProgressTest {
 public:
  static constexpr int64_t patience = 400;  ///< evaluations

  /// `stalls`: false of springs, which converge as slowly.
  explicit ProgressTest(bool stalls = true) : may_stall_(stalls) {}

  /// A state of the search.
  struct State {
    int64_t evaluations = 0;  ///< so far
    double objective = 0;
    double largest_force = 0;  ///< N
    double distance = 0;       ///< mm, or infinite where it is not known
    int64_t iteration = 0;
  };

  /// Forgets the search before.
  void begin() { *this = ProgressTest(may_stall_); }
  /// Takes the next state. Returns whether the search stalls or is at rounding.
  bool ends(const State& now);

  bool stalled() const { return stalled_; }
  bool at_rounding() const { return at_rounding_; }
  /// The smallest of its largest forces, N.
  double smallest_force() const { return best_.largest_force; }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  bool is_at_rounding(const State& now);
  bool stalls(const State& now);

  bool may_stall_, begun_ = false, stalled_ = false, at_rounding_ = false;
  double first_objective_ = 0, lowest_ = 0;
  int64_t lowered_at_ = 0;                          // iteration
  State best_{0, infinity, infinity, infinity, 0};  // each on its own; evaluations: of the latest
};

/// Where the largest block of a vector of unknowns is, mm, at the positions' last update.
/// Collective.
Vec3 place_of_largest(const discrete::Positions& positions, Vec vector);

}  // namespace repose::solve
