#pragma once
#include <cstdint>
#include <vector>

/// Runs: elements whose points are each one further on than those of the element before. In tissue
/// whose points are stored column after column they are what lies under one edge or triangle of the
/// skin. The kernels take a run at once, with plain loads in place of gathers.
namespace repose::mechanics {

/// Springs (first, second), (first + 1, second + 1), …
struct SpringRun {
  static constexpr int most = 4;
  int32_t first, second;
  int32_t count;  ///< 1 … most
};

/// Prisms (a0 a1 a2 a0+1 a1+1 a2+1), (a0+1 a1+1 a2+1 a0+2 a1+2 a2+2), …: a stack in which what is
/// below one prism is above the next.
struct PrismRun {
  static constexpr int most = 3;
  int32_t top[3];  ///< a0 a1 a2 of the first
  int32_t count;   ///< 1 … most
};

/// The runs among some consecutive elements of a loop, which begin with those in runs, run after
/// run. Four points from each first point of a run on, and four elements from its first on, can be
/// read, whatever its count.
template <class Run>
struct Runs {
  std::vector<Run> runs;
  int64_t elements = 0;  ///< in runs
};

/// Which kernels evaluate what lies in runs.
enum class Kernels {
  plain,  ///< any processor: one by one, as what lies in no run
  avx2,   ///< x86 with AVX2 and FMA: a run at once
  avx512  ///< x86 with AVX-512 F, VL and DQ, and FMA: two runs at once
};

/// What this processor can execute, slowest first.
std::vector<Kernels> available_kernels();
/// The last of them.
Kernels best_kernels();

}  // namespace repose::mechanics
