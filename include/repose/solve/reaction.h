#pragma once
#include <mpi.h>

#include <vector>

#include "repose/discrete/part.h"
#include "repose/model/step.h"

namespace repose::solve {

/// The forces (N) with which the tissue pushes on groups of points that are held: for each, minus
/// the sum over its points of the gradient of the spring energy and the volume term,
///     f = Σ_i [ Σ_springs at i (force of the spring on i) − Σ_prisms at i Φ_v'(v) ∂v/∂x_i ],
/// over all springs and prisms, also those that move no soft-tissue point; with volume form paper
/// both are weighted as in the objective, with the force functional it is the springs alone.
/// `groups`, rows of the whole model, are read on rank 0 only; `position` is this rank's slab at
/// the step `numbers`. Without groups there is no result, else all ranks have it. Collective.
std::vector<Vec3> reactions(MPI_Comm comm, const discrete::Part& part,
                            const std::vector<std::vector<int64_t>>& groups,
                            const model::StepNumbers& numbers, const std::vector<Vec3>& position);

}  // namespace repose::solve
