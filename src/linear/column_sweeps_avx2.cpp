#ifdef __x86_64__
#include <immintrin.h>

#include "column_sweep_loops.h"

namespace repose::linear {

namespace {

/// Eight entries at once, and the last.
class Products {
 public:
  void add(const PackedBlock* block, Lanes x) {
    const __m128 scaled = x * block->unit();
    const __m256 spread = _mm256_permutevar8x32_ps(_mm256_castps128_ps256(scaled),
                                                   _mm256_setr_epi32(0, 0, 0, 1, 1, 1, 2, 2));
    const auto* eight = reinterpret_cast<const __m128i*>(block->entry);
    const auto* ninth = reinterpret_cast<const __m128i*>(block->entry + 8);
    const __m256i entries = _mm256_cvtepi16_epi32(_mm_loadu_si128(eight));
    const __m128i last = _mm_cvtepi16_epi32(_mm_loadl_epi64(ninth));
    sums_ = _mm256_fmadd_ps(_mm256_cvtepi32_ps(entries), spread, sums_);
    last_ = _mm_fmadd_ss(_mm_cvtepi32_ps(last), _mm_movehl_ps(scaled, scaled), last_);
  }
  Lanes total() const {
    const __m128 low = _mm256_castps256_ps128(sums_), high = _mm256_extractf128_ps(sums_, 1);
    const __m128i second =
        _mm_alignr_epi8(_mm_castps_si128(high), _mm_castps_si128(low), 3 * sizeof(float));
    return low + _mm_castsi128_ps(second) + _mm_shuffle_ps(high, last_, _MM_SHUFFLE(0, 0, 3, 2));
  }

 private:
  __m256 sums_ = _mm256_setzero_ps();
  __m128 last_ = _mm_setzero_ps();
};

}  // namespace

const Sweeps avx2_sweeps = SweepLoops<Products>::table;

}  // namespace repose::linear
#endif
