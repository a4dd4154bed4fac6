#pragma once
#include <optional>

#include "repose/scene/scene.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"

/// What a scene's words mean to the solver; the only place that says so.
namespace repose::app {

/// The settings for a scene's solve section, whose bulk modulus is set where its volume term takes
/// one; the tissue is a solid or springs. Throws InputError where parts of it do not go together.
solve::Settings settings_of(const scene::Solve& wanted, bool solid);

/// How the tissue was when its surfaces were recorded, where the scene knows of any stress then.
std::optional<solve::Recording> recording_of(const scene::Scene& scene);

}  // namespace repose::app
