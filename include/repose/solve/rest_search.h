#pragma once
#include <petscvec.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/discrete/contact.h"

namespace repose::solve {

/// State of a search after an iteration, for progress reports.
struct Iteration {
  int64_t number = 0;
  double load = 0;
  double objective = 0;
  double largest_force = 0;      ///< largest block of ∇Φ
  double millimeters_to_go = 0;  ///< estimated distance to the rest position
  int64_t evaluations = 0;       ///< of value and gradient so far
  Vec displacement = nullptr;    ///< the state
};

inline constexpr const char* stopped_reason =
    "stopped before it was done, by a signal or the time limit";

/// Another rest position of the same load, of more energy.
struct OtherRest {
  double distance = 0;        ///< mm, the largest of the skin from the one that was chosen
  Vec3 place = Vec3::Zero();  ///< mm, where on the initial skin
  std::vector<Vec3> displacement = {};  ///< mm, [owned points] of this rank
  std::vector<int32_t> bodies = {};     ///< near edges of which points pressed, ascending
};

/// Outcome of a search for the rest position at one load.
struct Outcome {
  bool converged = false;         ///< the estimated distance is below the accuracy requested
  bool stopped = false;           ///< it was stopped early
  bool stable = false;            ///< no negative curvature was met at the end
  bool too_fine = false;          ///< not converged, as rounding limits the estimated distance
  double displacement_error = 0;  ///< mm, estimate of the largest distance to the rest position
  double objective = 0;
  double gradient_max = 0;  ///< N
  int64_t iterations = 0;
  int64_t overlapped = 0;  ///< points between bodies that overlap, which rest on one of them alone
  int64_t pierced = 0;     ///< columns and prisms that instruments are in at the end of a path
  std::string reason;
  std::optional<OtherRest> other;
};

/// Finds the rest position at a load.
class RestSearch {
 public:
  virtual ~RestSearch() = default;
  /// A prediction of its own of how the rest position moves from `displacement` at the positions'
  /// load to `load`: whether there is one, then in `increment`; nothing where the linear one
  /// serves. Collective.
  virtual std::optional<bool> predict(Vec /*displacement*/, double /*load*/, Vec /*increment*/) {
    return {};
  }
  /// From `displacement` (changed in place) at the positions' load, to `accuracy` mm; at load 1
  /// find_other() completes it. Collective.
  virtual Outcome run(Vec displacement, double accuracy) = 0;
  /// Comes within about `distance` mm of rest, for another search to continue from there. Returns
  /// the iterations and whether it was stopped. Collective.
  virtual Outcome presolve(Vec /*displacement*/, double /*distance*/) { return {}; }
  /// Searches from a `displacement` that is near to rest. Collective.
  virtual Outcome run_near(Vec displacement, double accuracy) {
    return run(displacement, accuracy);
  }
  /// Searches for other rest positions of load 1 after the search that ended at `displacement` with
  /// this outcome. These become the position of least energy, to `accuracy` mm, with its outcome,
  /// which states the distance to another. Collective.
  virtual void find_other(Vec /*displacement*/, double /*accuracy*/, Outcome& /*outcome*/) {}
  /// Returns the multipliers of contact with which the next search begins.
  virtual discrete::ContactPressures pressures() const { return {}; }
  /// Sets the multipliers of contact, as where a step is rejected; empty ones are 0. Collective.
  virtual void set_pressures(const discrete::ContactPressures& /*to*/) {}
};

}  // namespace repose::solve
