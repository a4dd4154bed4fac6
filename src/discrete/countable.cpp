#include "countable.h"

#include "repose/base/error.h"

namespace repose::discrete {

void require_countable(int64_t points, PetscInt largest) {
  if (points <= largest / 3) return;
  base::refuse(
      "the model has {} points, and this build of PETSc counts the coordinates of {} at most; "
      "build PETSc with --with-64-bit-indices, or make the mesh coarser or the layers fewer",
      points, largest / 3);
}

void require_addressable(int64_t pairs, PetscInt largest) {
  if (pairs <= largest / 9) return;
  base::refuse(
      "a rank would hold second derivatives of {} pairs of points, and this build of PETSc "
      "addresses those of {} at most; solve on more ranks, or build PETSc with "
      "--with-64-bit-indices",
      pairs, largest / 9);
}

}  // namespace repose::discrete
