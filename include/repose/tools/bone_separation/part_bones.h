#pragma once
#include "repose/imaging/volume.h"

/// Bones that touch in a CT, taken apart where they touch least: teeth in occlusion, joints.
namespace repose::tools::bone_separation {

using imaging::Volume;

/// All of a bone within this distance of a point of the first or the second is held in it, mm;
/// where both are near, in the second.
constexpr std::array<double, 2> part_hold = {10, 3};

struct PartedBones {
  std::array<Volume, 2> parts;  ///< the volume, each with the other bone below the level
  double cut_area;              ///< mm², of the faces of voxels between the two
};

/// Parts what lies at or above `level` into two bones by the minimum cut of the graph of its voxels
/// (6 neighbors; Boykov and Jolly, 2001): an edge costs the area of the face, eight times as much
/// where both voxels are well above the level. `points` lie in the first and in the second, mm,
/// LPS; too few, or too far from where the bones meet, and the least cut is around them. What hangs
/// together with neither goes to the first. The isosurfaces of the two parts are those of the
/// volume, but where the bones touched, 0.1 voxel within each. Throws InputError where a point has
/// no bone within part_hold, or one of the first lies where the second is held. Memory: 60 bytes
/// for each of the bones' voxels and 12 for any.
PartedBones part_bones(const Volume& volume, double level,
                       const std::array<std::vector<Vec3>, 2>& points);

}  // namespace repose::tools::bone_separation
