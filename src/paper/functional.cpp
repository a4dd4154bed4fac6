#include "repose/paper/functional.h"

namespace repose::paper {

solve::Settings settings_of(const Functional& functional, double accuracy) {
  constexpr double lambda = 0.5;
  solve::Settings settings;
  settings.force = functional.force;
  settings.path.accuracy = accuracy;
  if (functional.volume) {
    settings.volume = "paper";
    settings.lambda = lambda;
    settings.weights = {lambda, mechanics::VolumeTerm::paper, 1 - lambda};
  }
  return settings;
}

}  // namespace repose::paper
