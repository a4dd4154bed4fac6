#include "material_presets.h"

namespace repose::scene {

const std::vector<MaterialPreset>& material_presets() {
  static const std::vector<MaterialPreset> presets = {
      {"face", {{0.015, 0.45}, {}, {}}},
      {"skin_on_fat", {{0.015, 0.45}, {{1.5, {0.08, 0.45}}, {4.0, {0.003, 0.45}}}, {}}},
      {"incompressible", {{0.015, 0.49}, {}, {}}},
  };
  return presets;
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const MaterialPreset& preset : material_presets()) names.push_back(preset.name);
  return names;
}

}  // namespace repose::scene
