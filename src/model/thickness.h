#pragma once
#include <vector>

#include "bone_field.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// Distances that each column meets on its way inwards, [V] each; 0 before it is traced.
struct Reach {
  std::vector<double> to_bone;  ///< mm along the column to the first bone, infinite where none
  std::vector<double> room;     ///< mm a column that ends free may be long
  std::vector<char> holds;      ///< 1 where the bone met is the one beneath, near enough to attach
};

/// Casts rays down columns of a mesh. A bone holds a column where it is met within `attach_within`,
/// before the skin's own other side, and not much deeper than the nearest bone is away (1.6 times
/// and 2 mm: a ray that slips between teeth or into an orbit finds no bone). A free column keeps to
/// 0.95 of the way to bone and 0.45 of the way to the skin's other side.
class ColumnTracer {
 public:
  /// All arguments outlive it; `nearest` [V].
  ColumnTracer(const SkinMesh& mesh, const BoneField& bones,
               const std::vector<BoneField::Nearest>& nearest, const scene::Tissue& tissue);

  /// Traces the columns given by number along `directions` [V].
  void trace(const std::vector<int64_t>& columns, const std::vector<Vec3>& directions);
  const Reach& reach() const { return reach_; }

 private:
  const SkinMesh& mesh_;
  const BoneField& bones_;
  const std::vector<BoneField::Nearest>& nearest_;
  const scene::Tissue& tissue_;
  surface::DistanceTree skin_;
  Reach reach_;
};

/// Thickness [V] in mm: down to the bone where it holds, elsewhere from the neighboring bone's
/// depth to `free_thickness` over about that distance, within the room there is. Then lowered,
/// never raised: until the deep surface is nowhere steeper than 45° to the skin, and where a single
/// column stands out (one that grazes an edge of bone).
std::vector<double> column_thickness(const SkinMesh& mesh, const Reach& reach,
                                     double free_thickness);

}  // namespace repose::model
