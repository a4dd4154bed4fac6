#pragma once
#include <string>
#include <vector>

#include "bone_field.h"
#include "motion_range.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// Returns what of a scene's anatomy is implausible, one line each with what to do: coordinates
/// other than LPS, a head upside down or mirrored, bones exchanged, no bone at rest, a jaw that
/// does not fit the skull, a turn of the jaw about an axis far from its joints, lips that are one
/// skin although the jaw opens, and a flat skin. What a bone is, is known from its name; where the
/// names do not say, checks that need it are left out. `mesh` is the skin that is solved, its
/// normals inward; `bones` lie at their initial position.
std::vector<std::string> check_anatomy(const scene::Scene& scene, const MotionRange& range,
                                       const SkinMesh& mesh,
                                       const std::vector<surface::Surface>& bones);

/// One line about a skin whose outermost border lies within 15 mm of a bone that moves, before or
/// after its motion: how near, where, the effect on the face, and the remedy. Empty if there is no
/// such place. The measured effect is that of docs/guide/scene.md, "The border of the skin".
std::string describe_near_border(const scene::Scene& scene, const MotionRange& range,
                                 const std::vector<surface::Surface>& bones, const SkinMesh& mesh,
                                 const BoneField& field);

}  // namespace repose::model
