#pragma once
#include "repose/imaging/volume.h"

/// Points in the skull and in the jaw of a CT, found without a person.
namespace repose::tools::bone_separation {

using imaging::Volume;

/// Proposes points in the skull and in the jaw, mm, LPS, as part_bones() takes them. The head is
/// upright within some 25 degrees, in LPS; roll and yaw above 5 degrees are taken out by the mirror
/// symmetry of its bones. The chin is the lowest bone behind the front of the face, the occlusal
/// plane that of the densest values above it. Without a slab at the teeth, the level of bone is
/// raised until the chin's component leaves the skull: this is where the joints part. Points lie in
/// that component, up to the condyles, and in bone above the teeth. Where its rami do not reach
/// alike, the head is pitched to the usual way from chin to condyle, and voxels averaged to 2 mm
/// are searched, too. Throws InputError where the volume holds no chin, the chin's component no
/// rami, or where the volume ends inside the jaw.
std::array<std::vector<Vec3>, 2> propose_points(const Volume& volume, double level);

}  // namespace repose::tools::bone_separation
