#pragma once
#include "repose/solve/tangent_solver.h"

namespace repose::solve {

/// The smallest eigenvalue of the exact Hessian over the unknowns at `displacement` and the
/// positions' load, N/mm: positive at a strict minimum, negative where the tissue buckles. Not a
/// number if the eigenvalue solver (SLEPc) did not converge. Collective.
///
/// Up to `direct_limit` scalar unknowns by Krylov–Schur (Stewart 2001) with shift-and-invert at a
/// shift that MUMPS' inertia shows to be below every eigenvalue (Sylvester); above by LOBPCG
/// (Knyazev 2001) with the preconditioner of `solver`. `-eps_…` and `-st_…` options apply.
double smallest_eigenvalue(TangentSolver& solver, Vec displacement,
                           int64_t direct_limit = TangentSolver::direct_limit);

}  // namespace repose::solve
