#pragma once
#include <string>
#include <vector>

#include "repose/base/options.h"
#include "repose/scene/scene.h"

/// The options of repose-solve, and what they change of a scene.
namespace repose::app {

std::vector<base::Option> solve_options();

/// The command line beats the scene, and an option of its own the profile.
void override_by(const base::Options& options, scene::Solve& requested);

}  // namespace repose::app
