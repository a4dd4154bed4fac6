#pragma once
#include <optional>
#include <vector>

#include "repose/solve/repose.h"

namespace repose::solve {

/// Outcome of the search for springs that tear. Counts and lengths are rank 0's.
struct Tearing {
  std::optional<double> limit;  ///< N; unset where none was requested
  int rounds = 0;               ///< rest positions found
  bool settled = true;          ///< nothing at a loaded point or a tear is above the limit
  bool stopped = false;         ///< a search was stopped early
  bool torn = false;            ///< any spring was
  int64_t springs = 0, prisms = 0, triangles = 0;  ///< removed
  double length = 0;           ///< mm, largest distance of two torn springs' middles, initially
  Vec3 middle = Vec3::Zero();  ///< mm, mean of the torn springs' middles, initially
  double largest = 0;          ///< N, largest tension that counts in the last round
  std::vector<Vec3> position;  ///< [this rank's slab] mm, where a tear left the tissue; else empty
};

/// Tears springs by force (Teschner, Girod and Girod 2000, sec. 5): the model comes to rest; of the
/// springs at a point with an external force, or at an end of a spring torn before, all whose
/// tension is above the limit are removed (model::remove_springs); and so on from the positions
/// reached until none is. All of a round together, not the largest first: springs of nearly equal
/// tension then do not tear in an order that rounding chooses. Ends unsettled after 100 rounds,
/// where a rest position is not found or where the settings' interrupt is requested. `limit` (N)
/// and `model` are read, and the model changed, on rank 0; `start` as in find_repose. Throws
/// InputError where tissue is torn off. Collective.
Tearing tear(MPI_Comm comm, model::Model& model, const std::optional<double>& limit,
             const Settings& settings, const std::vector<Vec3>& start);

}  // namespace repose::solve
