#pragma once
#include <vector>

#include "column_layout.h"
#include "repose/model/build.h"

namespace repose::model {

/// Returns whether lips of the scene adhere to teeth.
inline bool adheres(const scene::Scene& scene) {
  return scene.anatomy && scene.anatomy->vestibule && scene.anatomy->adhesion > 0;
}

std::vector<AdheringJaw> adhering_jaws(const scene::AnatomyPlan& plan, const ColumnLayout& layout);

/// Returns the rule by which the elements of add_adhesion() are made, without columns of cuts.
AdhesionRule adhesion_rule(const scene::AnatomyPlan& plan, const std::vector<AdheringJaw>& jaws);

/// Adds the adhesion of the lips to the crowns of the front teeth of their own jaw to the model of
/// a piece: one element of mechanics::Adhesion for each deepest point that touches a jaw and lies
/// at its teeth, ascending. Columns on the path of a cut, which belong to both lips, have none.
void add_adhesion(const scene::AnatomyPlan& plan, const std::vector<surface::Surface>& bones,
                  const Piece& piece, Model& model);

}  // namespace repose::model
