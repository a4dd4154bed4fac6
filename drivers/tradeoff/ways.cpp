#include "ways.h"

#include <algorithm>

namespace repose::tradeoff {

using scene::VolumeTerm;

Way usual_way(const Plan& plan) {
  const VolumeTerm of_springs = plan.scene.solve.volume.value_or(VolumeTerm::penalty);
  return {.study = "solver",
          .method = plan.methods.front(),
          .accuracy = plan.scene.solve.accuracy,
          .volume = plan.scene.tissue.material ? VolumeTerm::material : of_springs,
          .load_steps = plan.scene.solve.load_steps,
          .layers = plan.scene.tissue.layers};
}

std::vector<Way> ways_of(const Plan& plan) {
  const Way usual = usual_way(plan);
  std::vector<Way> ways;
  const auto vary = [&](const std::string& study, const auto& values, auto&& change) {
    for (const auto& value : values) {
      Way way = usual;
      way.study = study;
      change(way, value);
      ways.push_back(way);
    }
  };
  for (const std::string& method : plan.methods)
    vary("solver", plan.accuracies, [&](Way& way, double accuracy) {
      way.method = method;
      way.accuracy = accuracy;
    });
  vary("load steps", plan.load_steps, [](Way& way, int steps) { way.load_steps = steps; });
  const bool solid = plan.scene.tissue.material.has_value();
  if (!solid)
    vary("volume", plan.volumes, [](Way& way, VolumeTerm volume) { way.volume = volume; });
  vary("layers", plan.layers, [](Way& way, int layers) { way.layers = layers; });
  if (solid)
    vary("springs", plan.layers, [](Way& way, int layers) {
      way.layers = layers;
      way.volume = VolumeTerm::penalty;
      way.method = "ntr";
    });
  vary("mesh", plan.edges.value_or(std::vector<double>{}),
       [](Way& way, double mm) { way.edge = mm; });
  return ways;
}

}  // namespace repose::tradeoff
