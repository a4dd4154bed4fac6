#pragma once
#include <vector>

#include "bone_field.h"
#include "repose/model/skin_mesh.h"

namespace repose::model {

/// Where a column may go at its skin vertex: unit vectors u with u · n ≥ cosine for the inward unit
/// normals n of all triangles around, so that a thin layer of tissue there is not folded.
struct Cone {
  Vec3 axis;      ///< the direction furthest from leaving it
  double cosine;  ///< 0.3, or less where the skin is so sharp that little room is left
};

/// One cone a skin vertex. Throws RefusedPlaces (skin_mesh.h) where no direction is inward of all
/// triangles around a vertex (a fold of the skin mesh).
std::vector<Cone> inward_cones(const SkinMesh& mesh, const std::string& skin_name);

/// Unit directions [V] of the columns: towards the nearest bone where that is inward and within
/// `attach_within` (mm), along the skin's normal elsewhere, smoothed over `length` (mm) [V] and
/// kept in the cones. `nearest` [V] is the nearest bone point of each skin vertex.
std::vector<Vec3> column_directions(const SkinMesh& mesh, const std::vector<Cone>& cones,
                                    const std::vector<BoneField::Nearest>& nearest,
                                    double attach_within, const std::vector<double>& length);

/// Averages the directions of `vertices` with their neighbors' and puts them back into their
/// cones.
void bend(const SkinMesh& mesh, const std::vector<Cone>& cones,
          const std::vector<int64_t>& vertices, std::vector<Vec3>& directions);

}  // namespace repose::model
