#include "functional.h"

#include "repose/app/settings.h"

namespace repose::paper {

solve::Settings settings_of(const Functional& functional, double accuracy) {
  scene::Solve requested;
  requested.functional = functional.force ? scene::Functional::force : scene::Functional::energy;
  requested.volume = functional.volume ? scene::VolumeTerm::paper : scene::VolumeTerm::none;
  requested.accuracy = accuracy;
  return app::settings_of(requested, false);
}

}  // namespace repose::paper
