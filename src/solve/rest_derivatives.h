#pragma once
#include <optional>

#include "repose/discrete/natural_rows.h"
#include "repose/solve/problem.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// Derivatives of the rest position `displacement` by the placements of pieces and the stiffnesses
/// of strata, added to `fields` as `tangent_<bone>_tx` … `_tz` (mm per mm) and `_rx` … `_rz` (mm
/// per degree), <bone> the row of Model::bones, and `tangent_young_<k>` (mm, by ln E of stratum k).
/// Each solves
///     H ∂x/∂p = −∂(∇Φ)/∂p
/// where points that press on a body stay pressed and at the body (held_response.h). For a piece
/// the right-hand side is a difference of gradients with the piece moved by ±1e-6; of a stratum, in
/// which ∇Φ is linear, its forces. The gradient of a scalar Σ w · x is wᵀ ∂x/∂p by one solve,
/// H λ = w. One preconditioner serves all right-hand sides. The flags `finished` and `convex` say
/// whether a linear solve reached the tolerance and met no negative curvature; where either is
/// false its result is 0. Returns the gradient, which is empty where none is requested, or nothing
/// where the settings' `abandoned` ended it before all were found. Collective.
std::optional<Gradient> differentiate(Problem& problem, const discrete::NaturalRows& natural,
                                      Vec displacement, const Settings& settings,
                                      std::vector<model::PointField>& fields);

}  // namespace repose::solve
