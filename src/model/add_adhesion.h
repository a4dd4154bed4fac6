#pragma once
#include <vector>

#include "repose/model/build.h"

namespace repose::model {

/// Returns whether lips of the scene adhere to teeth.
inline bool adheres(const scene::Scene& scene) {
  return scene.anatomy && scene.anatomy->vestibule && scene.anatomy->adhesion > 0;
}

/// Adds the adhesion of the lips to the crowns of the front teeth of their own jaw: one
/// element of mechanics::Adhesion for each deepest point that touches a jaw and lies at its teeth.
/// A remark counts them. `cuts` are those of the lips among others, whose columns belong to both.
void add_adhesion(const scene::AnatomyPlan& plan, const std::vector<surface::Surface>& bones,
                  const std::vector<Cut>& cuts, Model& model, std::vector<std::string>& remarks);

}  // namespace repose::model
