#pragma once
#include <filesystem>

#include "repose/scene/scene.h"

/// Data of the paper's figures (drivers/plot_paper.py).
namespace repose::paper {

/// Fig. 3: s (mm) and the tensions T(s)/k0 of the linear, quadratic and quartic law, s_ref = 1 mm.
void write_laws(const std::filesystem::path& file);

/// Fig. 2: a row for each soft-tissue point, its position (mm) and the force on it (N) under 10 %
/// turgor and weight, before and after the initial equilibrium.
void write_equilibrium(scene::Scene scene, const std::filesystem::path& file);

/// Figs. 5 and 7: solves a scene as repose-solve does and writes NAME.h5 with every load step.
/// Returns whether it converged. Serial.
bool write_rest(const scene::Scene& scene, const std::filesystem::path& name);

}  // namespace repose::paper
