#pragma once
#include <mpi.h>

#include <vector>

#include "repose/mechanics/energy.h"
#include "repose/model/model.h"

namespace repose::solve {

/// A rest position; on rank 0.
struct RestState {
  std::vector<Vec3> position;    ///< [N] mm
  std::vector<double> pressure;  ///< [N] N/mm², of contact; empty where there is none
};

/// Returns the first-order displacement of points at rest when their model changes into `other`,
/// which has the same points in other sets, of other material or otherwise loaded:
///     H δ = −∇Φ − H_sb Δx_b
/// with the energy of `other` at load 1 and the way Δx_b to where it has fixed points. Of points
/// that touch bodies those press that δ would take inside, in up to four solves. [N] mm on rank 0,
/// which has `other` and `rest`; empty where H is not positive definite or the linear solver comes
/// to no end. Collective.
std::vector<Vec3> first_order_change(MPI_Comm comm, const model::Model& other,
                                     const mechanics::Weights& weights, const RestState& rest);

}  // namespace repose::solve
