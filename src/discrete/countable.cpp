#include "countable.h"

#include "repose/base/error.h"

namespace repose::discrete {

void require_countable(int64_t points, PetscInt largest) {
  if (points <= largest / 3) return;
  base::refuse(
      "the model has {} points, and this build of PETSc counts the coordinates of {} at most; "
      "build "
      "PETSc with --with-64-bit-indices, or make the mesh coarser or the layers fewer",
      points, largest / 3);
}

}  // namespace repose::discrete
