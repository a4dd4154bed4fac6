#include "functional.h"

#include "repose/app/settings.h"

namespace repose::paper {

solve::Settings settings_of(const Functional& functional, double accuracy) {
  scene::Solve wanted;
  wanted.functional = functional.force ? scene::Functional::force : scene::Functional::energy;
  wanted.volume = functional.volume ? scene::VolumeTerm::paper : scene::VolumeTerm::none;
  wanted.accuracy = accuracy;
  return app::settings_of(wanted, false);
}

}  // namespace repose::paper
