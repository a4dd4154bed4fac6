#pragma once
#include "job.h"
#include "repose/solve/repose.h"

namespace repose::app {

/// Returns what a rest position is differentiated by: the motions of the pieces of the scene's
/// plan, or without one of the bones that move, and the stiffnesses of strata, none where the
/// tissue is springs, turgor or gravity is balanced initially, or volumes are averaged. On all
/// ranks. Collective.
solve::Derivatives plan_derivatives(MPI_Comm comm, const Job& job);

/// Row of the report: how many derivatives were found. On rank 0.
std::string describe_tangents(const std::vector<model::PointField>& fields);

}  // namespace repose::app
