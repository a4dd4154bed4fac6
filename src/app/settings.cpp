#include "repose/app/settings.h"

#include "repose/base/error.h"

namespace repose::app {

namespace {

using scene::VolumeTerm;

/// A solid's energy is its material's: nothing of how springs are minimized applies to it.
solve::Settings solid_settings(const scene::Solve& requested) {
  if (requested.functional == scene::Functional::force)
    base::refuse("functional force is of tissue.springs, and the tissue is a solid; choose energy");
  if (requested.volume)
    base::refuse(
        "solve.volume is of tissue.springs, and the tissue is a solid, whose Poisson's ratio says "
        "how it keeps its volume (tissue.material.poisson); remove it");
  solve::Settings settings;
  settings.weights = mechanics::solid_weights;
  return settings;
}

solve::Settings spring_settings(const scene::Solve& requested) {
  solve::Settings settings;
  settings.functional = requested.functional;
  const bool force = requested.functional == scene::Functional::force;
  const VolumeTerm volume = volume_of(requested);
  if (force && volume != VolumeTerm::none && volume != VolumeTerm::paper)
    base::refuse(
        "functional force takes volume none or paper, not {}: a penalty belongs to the energy; "
        "choose -functional energy or another -volume",
        word(volume));
  if (volume == VolumeTerm::penalty) settings.weights = {1, volume, requested.bulk_modulus.value()};
  if (volume == VolumeTerm::paper)
    settings.weights = {requested.lambda, volume, 1 - requested.lambda};
  return settings;
}

}  // namespace

solve::Settings settings_of(const scene::Solve& requested, bool solid) {
  solve::Settings settings = solid ? solid_settings(requested) : spring_settings(requested);
  settings.path.accuracy = requested.accuracy;
  settings.path.load_steps = requested.load_steps;
  return settings;
}

std::optional<solve::ReferenceState> reference_state_of(const scene::Scene& scene) {
  if (!(scene.tissue.turgor > 0 || scene.gravity)) return {};
  return solve::ReferenceState{scene.tissue.turgor,
                               scene.scan_gravity.value_or(scene.gravity.value_or(Vec3::Zero()))};
}

}  // namespace repose::app
