#pragma once
#include <functional>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

using Contains = std::function<bool(const Vec3&)>;

/// Returns a test of whether a point lies in a region, or no farther than `near` mm from it (to
/// half a voxel of a label map). Reads the region's file; throws InputError for a mesh that is not
/// closed.
Contains contains_of(const scene::Region& region, double near = 0);

/// Returns a test of whether a point of the skin lies in a region of space, or the painted mesh's
/// vertex nearest to it, within 10 mm, is painted.
Contains contains_of_skin(const scene::SkinRegion& region);

/// Test of tissue: true at a place in a region, in a column whose top is at a point of the skin.
using ContainsTissue = std::function<bool(const Vec3& place, const Vec3& skin)>;

/// Returns a test of whether tissue lies in a region: in space where its place does, and in a
/// painted one below its paint, to its depth. Reads the region's file as above.
ContainsTissue contains_tissue(const scene::SkinRegion& region);

/// Refuses painted meshes of which more than 5 % of the vertices lie more than 10 mm from the skin
/// that the scene names.
void check_painted_meshes(const scene::Tissue& tissue, const surface::Surface& skin);

}  // namespace repose::model
