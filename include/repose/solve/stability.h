#pragma once
#include <limits>

#include "repose/linear/tangent_solver.h"

namespace repose::solve {

/// The ends of the spectrum of a Hessian, N/mm; not a number where not found or not requested.
struct Spectrum {
  double smallest = std::numeric_limits<double>::quiet_NaN();  ///< positive at a strict minimum
  double largest = std::numeric_limits<double>::quiet_NaN();
};

/// The largest eigenvalue of the exact Hessian as it is assembled, by Krylov–Schur, to 1 %.
/// Collective.
double largest_eigenvalue(Mat hessian);

/// The smallest eigenvalue of the exact Hessian over the unknowns at `displacement` and the
/// positions' load, N/mm: positive at a strict minimum, negative where the tissue buckles. Not a
/// number if the eigenvalue solver (SLEPc) did not converge. Collective.
///
/// Up to `direct_limit` scalar unknowns by Krylov–Schur (Stewart 2001) with shift-and-invert at a
/// shift that MUMPS' inertia shows to be below every eigenvalue (Sylvester); above by generalized
/// Davidson (Morgan & Scott 1986) with the preconditioner of `solver`. `-eps_…` and `-st_…` options
/// apply.
///
/// `mode`, laid out as `displacement`, receives the eigenvector: the motion that the tissue resists
/// least. Its longest 3-vector has length 1, its largest entry is positive; zero where the
/// eigenvalue is not a number.
double smallest_eigenvalue(linear::TangentSolver& solver, Vec displacement, Vec mode,
                           int64_t direct_limit = linear::HessianPreconditioner::factors_limit);

/// The smallest eigenvalue of the exact Hessian, N/mm, to a relative error of 0.1, by generalized
/// Davidson with products of the Hessian and the preconditioner of `solver`; not a number if that
/// did not converge. `mode` receives the eigenvector, scaled as above. `-eps_…` options do not
/// apply. Collective.
double rough_smallest_eigenvalue(linear::TangentSolver& solver, Vec displacement, Vec mode);

}  // namespace repose::solve
