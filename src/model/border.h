#pragma once
#include <string>

#include "bone_field.h"
#include "motion_range.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// One line about a skin whose outermost border lies within 15 mm of a bone that moves, before or
/// after its motion: how near, where, the effect on the face, and the remedy. Empty if there is no
/// such place. The measured effect is that of docs/guide/scene.md, "The border of the skin".
std::string describe_near_border(const scene::Scene& scene, const MotionRange& range,
                                 const std::vector<surface::Surface>& bones, const SkinMesh& mesh,
                                 const BoneField& field);

}  // namespace repose::model
