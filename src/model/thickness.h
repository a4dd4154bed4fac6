#pragma once
#include <vector>

#include "bone_field.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// Distances that each column meets on its way inwards, [V] each.
struct Reach {
  std::vector<double> to_bone;  ///< mm along the column to the first bone, infinite where none
  std::vector<double> room;     ///< mm a column that ends free may be long
  std::vector<char> holds;      ///< 1 where the bone met is the one beneath, near enough to attach
};

/// Casts a ray down each of the columns given by number, into their entries of `reach` [V]. `skin`
/// is the tree of the mesh. A bone holds the column where it is met within `attach_within`,
/// before the skin's own other side, and not much deeper than the nearest bone is away (1.6 times
/// and 2 mm: a ray that slips between teeth or into an orbit finds no bone). A free column keeps to
/// 0.95 of the way to bone and 0.45 of the way to the skin's other side.
void trace_columns(const SkinMesh& mesh, const surface::DistanceTree& skin,
                   const std::vector<int64_t>& columns, const std::vector<Vec3>& directions,
                   const std::vector<BoneField::Nearest>& nearest, const BoneField& bones,
                   const scene::Tissue& tissue, Reach& reach);

/// Thickness [V] in mm: down to the bone where it holds, elsewhere from the neighboring bone's
/// depth to `free_thickness` over about that distance, within the room there is. Then lowered,
/// never raised: until the deep surface is nowhere steeper than 45° to the skin, and where a single
/// column stands out (one that grazes an edge of bone).
std::vector<double> column_thickness(const SkinMesh& mesh, const Reach& reach,
                                     double free_thickness);

}  // namespace repose::model
