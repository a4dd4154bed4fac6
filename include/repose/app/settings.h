#pragma once
#include <optional>

#include "repose/scene/scene.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"

/// Translation of a scene's solve section to the solver's settings.
namespace repose::app {

/// The settings for a scene's solve section, whose bulk modulus is set where its volume term takes
/// one; the tissue is a solid or springs. Throws InputError where parts of it do not go together.
solve::Settings settings_of(const scene::Solve& requested, bool solid);

/// Returns the state of the tissue when its surfaces were recorded; empty for a stress-free scene.
std::optional<solve::ReferenceState> reference_state_of(const scene::Scene& scene);

}  // namespace repose::app
