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
  /// mm, largest distance of the skin's rest position from that of the rung before, at the scene's
  /// skin vertices; ∞ for the first.
  double skin_change = 0;
  /// mm, estimate of the largest distance of the skin's rest position from that of the scene's own
  /// model; ∞ for the first.
  double discretisation_error = 0;
};

/// What coarser models of a scene came to.
struct Ladder {
  std::vector<Rung> rungs;          ///< coarsest first, those that came to rest
  std::vector<Vec3> position;       ///< [N] on rank 0: the last one's answer at the scene's points
  std::vector<Vec3> before;         ///< likewise of the rung before it, or empty
  model::BuiltModel last;           ///< the last one's model, on rank 0
  std::vector<Vec3> last_position;  ///< its rest position, mm, on rank 0
  solve::Settings last_settings;    ///< what it was solved with
  bool near_enough = false;         ///< the last one is within Climb::enough
  bool stopped = false;             ///< by a signal or the time limit
  std::string refusal;              ///< why it ended before its last rung, or empty; on rank 0
};

/// What is wanted of a climb.
struct Climb {
  std::vector<Resolution> rungs;              ///< coarsest first
  std::optional<solve::Recording> recording;  ///< initial equilibrium of every model
  solve::Settings settings;                   ///< of the scene's own model
  /// mm: a rung whose discretisation error and search error are together no more is the last one;
  /// 0: all are solved.
  double enough = 0;
};

/// Resolutions that lead to the answer of the scene's own: edges three times as long from rung to
/// rung, as long as the coarsest keeps enough columns to be worth solving, and one layer fewer
/// where the scene lets layers be any number (layers_are_free).
std::vector<Resolution> guiding_rungs(const model::Anatomy& anatomy);

/// Whether these pay before a model is solved: not where one long load step is cheaper, or, on
/// meshes so fine that tissue buckles, two short ones. On rank 0.
bool guides_pay(const model::Anatomy& anatomy, const model::Model& fine);

/// Resolutions that are compared to see how fine is fine enough: likewise, with edges twice as long
/// from rung to rung and about `most_columns` at most.
std::vector<Resolution> compared_rungs(const model::Anatomy& anatomy, int64_t most_columns);

/// Solves the coarse models from the coarsest up, the first along the load path, each other from
/// the answer before it. `anatomy` and `fine`, its model without incisions, on rank 0 only. A rung
/// that cannot be built or does not converge ends the climb. Collective.
Ladder climb(MPI_Comm comm, const model::Anatomy& anatomy, const model::Model& fine,
             const Climb& wanted);

}  // namespace repose::adapt
