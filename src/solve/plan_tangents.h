#pragma once
#include "repose/discrete/natural_rows.h"
#include "repose/solve/problem.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// Derivatives of the rest position by the placements of pieces, as point fields
/// `tangent_<bone>_tx` … `_tz` (mm per mm) and `_rx` … `_rz` (mm per degree), <bone> the row of
/// Model::bones. Each solves
///     H ∂x/∂p = −∂(∇Φ)/∂p
/// at the rest position `displacement`, where the right-hand side is a difference of gradients with
/// the piece moved by ±1e-6, points that press on a body stay pressed, and the penalty is 16 times
/// as stiff about their pressures, which holds them at the body. One preconditioner serves all
/// right-hand sides. The flags `finished` and `convex` of a field say whether its linear solve
/// reached the tolerance and met no negative curvature; where either is false the field is 0.
/// Collective.
std::vector<model::PointField> plan_tangents(Problem& problem, const discrete::NaturalRows& natural,
                                             Vec displacement,
                                             const std::vector<PlanPiece>& pieces);

}  // namespace repose::solve
