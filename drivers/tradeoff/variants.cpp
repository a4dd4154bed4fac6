#include "study.h"

namespace repose::tradeoff {

using scene::VolumeTerm;

Variant usual_variant(const Plan& plan) {
  const VolumeTerm of_springs = plan.scene.solve.volume.value_or(VolumeTerm::penalty);
  return {.study = "solver",
          .method = plan.methods.front(),
          .accuracy = plan.scene.solve.accuracy,
          .volume = plan.scene.tissue.material ? VolumeTerm::material : of_springs,
          .load_steps = plan.scene.solve.load_steps,
          .layers = plan.scene.tissue.layers};
}

std::vector<Variant> variants_of(const Plan& plan) {
  const Variant usual = usual_variant(plan);
  std::vector<Variant> variants;
  const auto vary = [&](const std::string& study, const auto& values, auto&& change) {
    for (const auto& value : values) {
      Variant variant = usual;
      variant.study = study;
      change(variant, value);
      variants.push_back(variant);
    }
  };
  for (const std::string& method : plan.methods)
    vary("solver", plan.accuracies, [&](Variant& variant, double accuracy) {
      variant.method = method;
      variant.accuracy = accuracy;
    });
  vary("load steps", plan.load_steps,
       [](Variant& variant, int steps) { variant.load_steps = steps; });
  const bool solid = plan.scene.tissue.material.has_value();
  if (!solid)
    vary("volume", plan.volumes,
         [](Variant& variant, VolumeTerm volume) { variant.volume = volume; });
  vary("layers", plan.layers, [](Variant& variant, int layers) { variant.layers = layers; });
  if (solid)
    vary("springs", plan.layers, [](Variant& variant, int layers) {
      variant.layers = layers;
      variant.volume = VolumeTerm::penalty;
      variant.method = "ntr";
    });
  vary("mesh", plan.edges.value_or(std::vector<double>{}),
       [](Variant& variant, double mm) { variant.edge = mm; });
  return variants;
}

}  // namespace repose::tradeoff
