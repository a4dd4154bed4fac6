#pragma once
#include <mpi.h>

#include <optional>
#include <string>
#include <vector>

#include "repose/adapt/coarse_model.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"

namespace repose::adapt {

/// What one coarse model took, and how far it brought the answer.
struct Rung {
  Resolution resolution;
  int64_t points = 0, unknowns = 0;
  int64_t evaluations = 0, assemblies = 0;  ///< of the gradient and of the Hessian
  double seconds = 0;                       ///< wall, building included
  double change =
      0;  ///< mm, largest distance from the rung before at the scene's points; ∞ at first
  double skin_change = 0;  ///< likewise, over the skin
};

/// What a nested iteration came to before the scene's own model.
struct Ladder {
  std::vector<Rung> rungs;     ///< coarsest first, those that converged
  std::vector<Vec3> position;  ///< [N] on rank 0: the last rung's answer at the scene's points, mm
  bool stopped = false;        ///< by a signal or the time limit
  std::string refusal;         ///< why it ended before its last rung, or empty; on rank 0
};

/// What is wanted of a nested iteration.
struct Climb {
  std::vector<Resolution> rungs;              ///< coarsest first
  std::optional<solve::Recording> recording;  ///< initial equilibrium of every model
  solve::Settings settings;                   ///< of the scene's own model
};

/// Resolutions below that of a model of `skin` with `columns` skin vertices: edges doubled from
/// rung to rung as long as the coarsest keeps enough columns to be worth solving; empty where none
/// does.
std::vector<Resolution> rungs_below(const scene::Scene& scene, const surface::Surface& skin);

/// Solves the coarse models from the coarsest up, the first along the load path, each other from
/// the answer before it. `anatomy` and `fine`, its model without incisions, on rank 0 only. A rung
/// that cannot be built or does not converge ends the climb. Collective.
Ladder climb(MPI_Comm comm, const model::Anatomy& anatomy, const model::Model& fine,
             const Climb& wanted);

}  // namespace repose::adapt
