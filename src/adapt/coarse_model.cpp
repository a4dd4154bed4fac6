#include "repose/adapt/coarse_model.h"

#include <algorithm>
#include <cctype>

#include "repose/meshtools/remesh.h"
#include "repose/model/skin_mesh.h"
#include "repose/model/stiffness.h"

namespace repose::adapt {

namespace {

using model::Model;

/// Material of the springs of one kind.
struct Material {
  double stiffness = 0;  // Σ k0 r_0², N·mm
  double volume = 0;     // Σ v_j, mm³
  double reference = 0;  // Σ v_j s_ref / r_0, mm³
  int8_t exponent = 2;

  double modulus() const { return volume > 0 ? stiffness / volume : 0; }
  double strain() const { return volume > 0 ? reference / volume : 1; }
};

/// "layer 2" where layers have the same numbers in both models, "layer" where they have not.
std::string kind_of(const std::string& set, bool same_layers) {
  return same_layers ? set : set.substr(0, set.find(' '));
}

std::map<std::string, Material> materials(const surface::Surface& skin, const Model& model,
                                          bool same_layers) {
  const std::vector<double> volumes =
      model::spring_volumes(model::make_skin_mesh(skin), model.prisms.rest_volume);
  std::vector<Material> of_set(model.spring_sets.size());
  const model::Springs& springs = model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const double r0 = length(model, j);
    Material& material = of_set[springs.set[j]];
    material.stiffness += springs.stiffness[j] * r0 * r0;
    material.volume += volumes[j];
    material.reference += volumes[j] * springs.reference[j] / r0;
    material.exponent = springs.exponent[j];
  }
  std::map<std::string, Material> kinds;
  for (size_t s = 0; s < of_set.size(); ++s) {
    Material& kind = kinds[kind_of(model.spring_sets[s], same_layers)];
    kind.stiffness += of_set[s].stiffness;
    kind.volume += of_set[s].volume;
    kind.reference += of_set[s].reference;
    kind.exponent = of_set[s].exponent;
  }
  return kinds;
}

/// `model` was built with a modulus of 1 throughout.
void give_material(const std::map<std::string, Material>& kinds, bool same_layers, Model& model) {
  model::Springs& springs = model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const Material& material = kinds.at(kind_of(model.spring_sets[springs.set[j]], same_layers));
    springs.stiffness[j] *= material.modulus();
    springs.reference[j] = material.strain() * length(model, j);
    springs.exponent[j] = material.exponent;
  }
}

}  // namespace

bool layers_are_free(const scene::Tissue& tissue) {
  const auto names_a_layer = [](const auto& rule) {
    return std::any_of(rule.first.begin(), rule.first.end(),
                       [](unsigned char c) { return std::isdigit(c); });
  };
  return tissue.depths.empty() && tissue.depths_mm.empty() && tissue.mass.empty() &&
         std::none_of(tissue.springs.begin(), tissue.springs.end(), names_a_layer);
}

model::BuiltModel coarse_model(const model::Anatomy& anatomy, const Model& fine,
                               const Resolution& resolution) {
  scene::Scene scene = anatomy.scene;
  const int layers = resolution.layers > 0 ? resolution.layers : scene.tissue.layers;
  const bool same_layers = layers == scene.tissue.layers;
  scene.tissue.layers = layers;
  const surface::Surface skin =
      resolution.edge > 0 ? meshtools::remesh(anatomy.skin, resolution.edge) : anatomy.skin;
  if (scene.tissue.material || scene.tissue.isotropic)
    return model::build_model(scene, skin, anatomy.bones);
  scene.tissue.springs = {
      {"default", {.stiffness = {}, .modulus = 1.0, .law = {}, .reference = 0.0}}};
  model::BuiltModel built = model::build_model(scene, skin, anatomy.bones);
  give_material(materials(anatomy.skin, fine, same_layers), same_layers, built.model);
  return built;
}

}  // namespace repose::adapt
