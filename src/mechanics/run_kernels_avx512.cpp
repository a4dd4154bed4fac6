#ifdef __x86_64__
#include "lane_kernels.h"

namespace repose::mechanics {
const RunKernels avx512_kernels = LaneKernels<2>::table;
}  // namespace repose::mechanics
#endif
