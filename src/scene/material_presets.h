#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"

/// Materials from the literature, by name (sources in docs/guide/materials.md).
namespace repose::scene {

struct MaterialPreset {
  std::string name;
  Material material;
};

/// The first is the default.
const std::vector<MaterialPreset>& material_presets();

/// Their names, in order.
std::vector<std::string> preset_names();

}  // namespace repose::scene
