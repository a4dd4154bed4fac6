#pragma once
#include <petscversion.h>

/// The one place for names that changed between the PETSc releases we stand on (3.18 … 3.22).
#if PETSC_VERSION_LT(3, 21, 0)
#define TaoMonitorSet TaoSetMonitor
#endif
#if PETSC_VERSION_LT(3, 19, 0)
#define PETSC_SUCCESS 0
#endif
