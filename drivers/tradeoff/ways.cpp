#include "ways.h"

#include <algorithm>

#include "repose/app/options.h"

#include <algorithm>

namespace repose::tradeoff {

std::string volume_word(const scene::Scene& scene) {
  if (scene.tissue.material) return "material";
  const auto form = scene.solve.volume.value_or(scene::VolumeForm::penalty);
  return app::volume_words()[static_cast<size_t>(form)];
}

std::optional<scene::VolumeForm> volume_form(const std::string& word) {
  const auto& words = app::volume_words();
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end()) return {};
  return static_cast<scene::VolumeForm>(found - words.begin());
}

Way usual_way(const Plan& plan) {
  return {.study = "solver",
          .method = plan.methods.front(),
          .accuracy = plan.scene.solve.accuracy,
          .volume = volume_word(plan.scene),
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
    vary("volume", plan.volumes, [](Way& way, const std::string& form) { way.volume = form; });
  vary("layers", plan.layers, [](Way& way, int layers) { way.layers = layers; });
  if (solid)
    vary("springs", plan.layers, [](Way& way, int layers) {
      way.layers = layers;
      way.volume = "penalty";
      way.method = "ntr";
    });
  vary("mesh", plan.edges.value_or(std::vector<double>{}),
       [](Way& way, double mm) { way.edge = mm; });
  return ways;
}

}  // namespace repose::tradeoff
