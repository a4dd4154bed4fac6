#pragma once
#include <string>
#include <vector>

#include "attachment.h"
#include "repose/model/model.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// Columns that are boundary points in whole: the longest border loop of an open skin where the
/// scene fixes the rim, [V] 1 or 0. Other loops (mouth, eyes) are free edges.
std::vector<char> rim_columns(const SkinMesh& mesh, bool rim_fixed);

/// Says what every point of a model of make_layers is: rim columns are boundary points, the deepest
/// points of the attached columns bone points with the bone's number and, as target, where its move
/// takes them; the rest is soft tissue. `moves` is [bones].
void set_points(const std::vector<char>& rim, const ColumnEnds& ends,
                const std::vector<scene::RigidMotion>& moves, Model& model);

/// Refuses, in one line naming the scene, a model without a free point, one that nothing holds, and
/// a bone that moves while no tissue is attached to it; a bone that stays and holds nothing is a
/// remark. The sets of the points, as counted, are final.
void require_held(const scene::Scene& scene, const SkinMesh& mesh, const BoneField& bones,
                  const Counts& counts, Attachment& attachment);

}  // namespace repose::model
