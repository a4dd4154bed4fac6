#ifdef __x86_64__
#include "lane_kernels.h"

namespace repose::mechanics {
const RunKernels avx2_kernels = LaneKernels<1>::table;
}  // namespace repose::mechanics
#endif
