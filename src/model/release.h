#pragma once
#include <vector>

#include "attachment.h"
#include "repose/scene/rigid_motion.h"

namespace repose::model {

/// How tissue lets go of bone.
struct Release {
  double distance;    ///< mm; 0: nowhere
  scene::Attach how;  ///< what it does then
};

/// Lets go of the deepest points within a distance of the surface of a bone piece whose motion
/// differs from that of their own bone (docs/theory/load_path.md: real tissue slides
/// there). Distances are at the initial position; `moves` is [bones].
void release_near_other_pieces(const std::vector<Vec3>& deep, const BoneField& bones,
                               const std::vector<scene::RigidMotion>& moves, const Release& release,
                               Attachment& attachment);

/// Lets go of the deepest points of bones that move within a distance of the deepest point of a
/// rim column (`rim` [V], 1 or 0): the rim stays where it is, so to bones that move it is another
/// piece.
void release_near_rim(const std::vector<Vec3>& deep, const std::vector<char>& rim,
                      const std::vector<scene::RigidMotion>& moves, const Release& release,
                      Attachment& attachment);

}  // namespace repose::model
