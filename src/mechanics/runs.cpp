#include "repose/mechanics/runs.h"

namespace repose::mechanics {

std::vector<Kernels> available_kernels() {
  std::vector<Kernels> available = {Kernels::plain};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    available.push_back(Kernels::avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("fma"))
    available.push_back(Kernels::avx512);
#endif
  return available;
}

Kernels best_kernels() {
  static const Kernels best = available_kernels().back();
  return best;
}

}  // namespace repose::mechanics
