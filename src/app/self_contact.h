#pragma once
#include <string>
#include <vector>

#include "job.h"

namespace repose::app {

/// The skin that is solved, on rank 0, where it was before anything moves. Skin that ends inside
/// other skin is reported: nothing keeps it apart.
class SolvedSkin {
 public:
  explicit SolvedSkin(const Job& job);

  /// Row of the closing table on triangles that pass through others and did not at the start, empty
  /// without any. `position`: of all points of the model, or of the skin alone if the model is
  /// distributed. Pairs beside the same cut are left out if contact keeps its sides apart.
  std::string describe_self_contact(const std::vector<Vec3>& position) const;

  /// Where its points were, and where they are.
  const std::vector<Vec3>& initial_points() const { return initial_.points; }
  std::vector<Vec3> points_at(const std::vector<Vec3>& position) const;

 private:
  surface::Surface initial_;
  std::vector<int64_t> row_;     // [points] of the model
  std::vector<char> on_a_side_;  // [points] it is on a side of a cut that contact keeps apart
};

}  // namespace repose::app
