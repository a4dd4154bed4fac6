#pragma once
#include <mpi.h>

#include <optional>
#include <string>
#include <vector>

#include "repose/adapt/coarse_model.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"

namespace repose::adapt {

/// Work and error of one coarse model.
struct Level {
  Resolution resolution;
  int64_t points = 0;
  int64_t evaluations = 0, assemblies = 0;  ///< of the gradient and of the Hessian
  double seconds = 0;                       ///< wall, building included
  /// mm, largest distance of the skin's rest position from that of the level before, at the scene's
  /// skin vertices; ∞ for the first.
  double skin_change = 0;
  /// mm, estimate of the largest distance of the skin's rest position from that of the scene's own
  /// model; ∞ for the first.
  double discretization_error = 0;
};

/// Results of a sequence of coarser models.
struct GridSequence {
  std::vector<Level> levels;        ///< coarsest first, those that came to rest
  std::vector<Vec3> initial;        ///< [N] on rank 0: the scene's points, …
  std::vector<int32_t> layer;       ///< … and their layers
  std::vector<Vec3> position;       ///< [N] on rank 0: the last one's answer at the scene's points
  std::vector<Vec3> before;         ///< likewise of the level before it, or empty
  model::BuiltModel last;           ///< the last one's model, on rank 0
  std::vector<Vec3> last_position;  ///< its rest position, mm, on rank 0
  solve::Settings last_settings;    ///< what it was solved with
  bool near_enough = false;         ///< the last one is within SequencePlan::enough
  std::string refusal;              ///< why it ended before its last level, or empty; on rank 0
};

/// Levels and accuracy of a sequence of models.
struct SequencePlan {
  std::vector<Resolution> levels;                        ///< coarsest first
  std::optional<solve::ReferenceState> reference_state;  ///< initial equilibrium of every model
  solve::Settings settings;                              ///< of the scene's own model
  /// mm: a level whose discretization error and search error are together no more is the last one;
  /// 0: all are solved.
  double enough = 0;
};

/// Resolutions that are compared to see how fine is fine enough: edges twice as long from level to
/// level, from about `max_columns` down to the fewest worth solving, and one layer fewer where the
/// scene lets layers be any number (layers_are_free).
std::vector<Resolution> compared_resolutions(const model::Anatomy& anatomy, int64_t max_columns);

/// Solves the coarse models from the coarsest up, the first along the load path, each other from
/// the answer before it. `anatomy` and `fine`, its model without incisions, on rank 0 only. A level
/// that cannot be built or does not converge ends the sequence. Collective.
GridSequence solve_sequence(MPI_Comm comm, const model::Anatomy& anatomy, const model::Model& fine,
                            const SequencePlan& requested);

}  // namespace repose::adapt
