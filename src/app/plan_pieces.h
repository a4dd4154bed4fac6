#pragma once
#include "job.h"
#include "repose/solve/repose.h"

namespace repose::app {

/// Returns the pieces by whose motions a rest position is differentiated: those of the scene's
/// plan, or without one the bones that move. On all ranks. Collective.
std::vector<solve::PlanPiece> plan_pieces(MPI_Comm comm, const Job& job);

/// Returns the strata by whose stiffnesses a rest position is differentiated, from the skin down:
/// none where the tissue is springs, turgor or gravity is balanced initially, or volumes are
/// averaged. On all ranks. Collective.
std::vector<solve::Stratum> plan_strata(MPI_Comm comm, const Job& job);

/// Row of the report: how many derivatives were found. On rank 0.
std::string describe_tangents(const std::vector<model::PointField>& fields);

}  // namespace repose::app
