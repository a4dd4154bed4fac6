#include "repose/app/settings.h"

#include "repose/base/error.h"

namespace repose::app {

namespace {

using scene::VolumeTerm;

/// A solid's energy is its material's: nothing of how springs are minimised applies to it.
solve::Settings solid_settings(const scene::Solve& wanted) {
  if (wanted.functional == scene::Functional::force)
    base::refuse("functional force is of tissue.springs, and the tissue is a solid; choose energy");
  if (wanted.volume)
    base::refuse(
        "solve.volume is of tissue.springs, and the tissue is a solid, whose Poisson's ratio says "
        "how it keeps its volume (tissue.material.poisson); remove it");
  solve::Settings settings;
  settings.weights = mechanics::solid_weights;
  return settings;
}

solve::Settings spring_settings(const scene::Solve& wanted) {
  solve::Settings settings;
  settings.functional = wanted.functional;
  const bool force = wanted.functional == scene::Functional::force;
  const VolumeTerm volume = wanted.volume.value_or(force ? VolumeTerm::none : VolumeTerm::penalty);
  if (force && volume != VolumeTerm::none && volume != VolumeTerm::paper)
    base::refuse(
        "functional force takes volume none or paper, not {}: a penalty belongs to the energy; "
        "choose -functional energy or another -volume",
        word(volume));
  if (volume == VolumeTerm::penalty) settings.weights = {1, volume, wanted.bulk_modulus.value()};
  if (volume == VolumeTerm::paper) settings.weights = {wanted.lambda, volume, 1 - wanted.lambda};
  return settings;
}

}  // namespace

solve::Settings settings_of(const scene::Solve& wanted, bool solid) {
  solve::Settings settings = solid ? solid_settings(wanted) : spring_settings(wanted);
  settings.path.accuracy = wanted.accuracy;
  settings.path.load_steps = wanted.load_steps;
  return settings;
}

std::optional<solve::Recording> recording_of(const scene::Scene& scene) {
  if (!(scene.tissue.turgor > 0 || scene.gravity)) return {};
  return solve::Recording{scene.tissue.turgor,
                          scene.scan_gravity.value_or(scene.gravity.value_or(Vec3::Zero()))};
}

}  // namespace repose::app
