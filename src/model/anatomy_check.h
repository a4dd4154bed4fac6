#pragma once
#include <string>
#include <vector>

#include "motion_range.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

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

}  // namespace repose::model
