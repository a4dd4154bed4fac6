#pragma once
#include <mpi.h>

#include <vector>

#include "repose/model/model.h"
#include "repose/model/step.h"

namespace repose::solve {

/// The forces (N) with which the tissue pushes on groups of points that are held: for each, minus
/// the sum over its points of the gradient of the spring energy and the volume term,
///     f = Σ_i [ Σ_springs at i (force of the spring on i) − Σ_prisms at i Φ_v'(v) ∂v/∂x_i ],
/// over all springs and prisms, also those that move no soft-tissue point; with volume form paper
/// both are weighted as in the objective, with the force functional it is the springs alone.
/// `model` and `groups` are read on rank 0 only, which also has the result; `rows` are the
/// slabs of the step `numbers`. Collective.
std::vector<Vec3> reactions(MPI_Comm comm, const model::Model& model,
                            const std::vector<std::vector<int64_t>>& groups,
                            const model::StepNumbers& numbers, const model::StepRows& rows);

}  // namespace repose::solve
