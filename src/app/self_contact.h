#pragma once
#include <string>
#include <vector>

#include "job.h"

namespace repose::app {

/// The skin that is solved, on rank 0, where it was before anything moves. Skin that ends inside
/// other skin is reported: nothing keeps it apart.
class SolvedSkin {
 public:
  /// Takes the skin of a job whose model is distributed. Collective.
  SolvedSkin(MPI_Comm comm, const Job& job);

  /// Row of the closing table on triangles that pass through others and did not at the start, empty
  /// without any. `points` are those of points_at(). Pairs beside the same cut are left out if
  /// contact keeps its sides apart. On rank 0.
  std::string describe_self_contact(const std::vector<Vec3>& points) const;

  const surface::Surface& initial() const { return initial_; }
  /// Rows of its points in the model, ascending, on all ranks.
  const std::vector<int64_t>& rows() const { return row_; }
  /// Its points, on rank 0, of this rank's slab of positions. Collective.
  std::vector<Vec3> points_at(const std::vector<Vec3>& slab) const;

 private:
  MPI_Comm comm_;
  surface::Surface initial_;
  std::vector<int64_t> row_;     // [points]
  std::vector<char> on_a_side_;  // [points] it is on a side of a cut that contact keeps apart
};

}  // namespace repose::app
