#pragma once
#include "repose/discrete/function.h"
#include "repose/linear/tangent_solver.h"

namespace repose::solve {

/// Moves `displacement` along the direction of least curvature of `function`, where that is
/// negative, to the side of a smaller value: by 0.3 mm, or a third of that repeatedly, and as far
/// as doubled moves lower the value. Returns false, and leaves it, where neither side has less.
/// `solver` solves with the Hessian of `function`. Collective.
bool leave_saddle(discrete::Function& function, linear::TangentSolver& solver, Vec displacement);

}  // namespace repose::solve
