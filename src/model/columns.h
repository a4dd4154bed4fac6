#pragma once
#include <string>
#include <vector>

#include "bone_field.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// The straight columns of tissue beneath the skin vertices, [V] each.
struct Columns {
  std::vector<Vec3> deep;         ///< mm, the deepest point
  std::vector<double> thickness;  ///< mm, distance from the skin vertex to it
  std::vector<char> holds;        ///< 1 where bone lies beneath, near enough to attach
  int64_t bent = 0;               ///< columns turned towards their neighbors' directions …
  int64_t shortened = 0;          ///< … and made shorter so that neighbors do not cross
};

/// Lays a column from each skin vertex to the bone beneath. The directions are smoothed over half
/// the depth of the tissue; where columns would cross they are shortened, so that afterwards no
/// prism of any number of layers is folded (fold.h); with tissue.edge they are bent first.
/// `nearest` [V] is the nearest bone point of each skin vertex. Throws RefusedPlaces (skin_mesh.h)
/// where that cannot be.
Columns compute_columns(const SkinMesh& mesh, const BoneField& bones,
                        const std::vector<BoneField::Nearest>& nearest, const scene::Tissue& tissue,
                        const std::string& skin_name);

}  // namespace repose::model
