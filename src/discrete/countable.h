#pragma once
#include <petscsys.h>

#include <cstdint>

namespace repose::discrete {

/// Throws InputError where a model's coordinates, three a point, are more than the whole numbers of
/// PETSc can count: 2³¹ − 1 unless it was built with 64-bit indices.
void require_countable(int64_t points, PetscInt largest = PETSC_MAX_INT);

/// Checks the size of a rank's assembled Hessian, nine numbers a pair of points.
void require_addressable(int64_t pairs, PetscInt largest = PETSC_MAX_INT);

}  // namespace repose::discrete
