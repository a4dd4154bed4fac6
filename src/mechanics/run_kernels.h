#pragma once
#include "repose/mechanics/loops.h"

/// The kernels for what lies in runs, in one table for each set of instructions.
namespace repose::mechanics {

/// A loop's springs in runs; arrays begin at the first of them.
struct SpringsInRuns {
  int exponent;
  const SpringRun* run;
  int64_t runs;
  const double *stiffness, *rest_length, *inverse_reference;
};

/// The edges in runs; arrays begin at the first of them.
struct EdgesInRuns {
  const SpringRun* run;
  int64_t runs;
  const double* weight;
};

/// The prisms in runs; arrays begin at the first of them.
struct PrismsInRuns {
  const PrismRun* run;
  int64_t runs;
  const double *compliance, *target_volume;
};

/// Kernels as in energy.h; positions, gradients, directions and products are [3 P] numbers.
struct RunKernels {
  double (*spring_gradient)(const SpringsInRuns& springs, const double* position, double scale,
                            double* gradient);
  void (*spring_action)(const SpringsInRuns& springs, const double* position, double scale,
                        const double* direction, double* product);
  double (*edge_gradient)(const EdgesInRuns& edges, const double* position, double scale,
                          double* gradient);
  double (*prism_gradient)(const PrismsInRuns& prisms, const double* position,
                           const Weights& weights, double* gradient);
  void (*prism_action)(const PrismsInRuns& prisms, const double* position, const Weights& weights,
                       const double* direction, double* product);
};

#ifdef __x86_64__
extern const RunKernels avx2_kernels, avx512_kernels;
#endif

}  // namespace repose::mechanics
