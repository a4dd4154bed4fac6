#ifdef __x86_64__
#include <immintrin.h>

#include "column_sweep_loops.h"

namespace repose::linear {

namespace {

/// All entries at once.
class Products {
 public:
  void add(const PackedBlock* block, Lanes x) {
    int32_t last_and_unit;
    std::memcpy(&last_and_unit, block->entry + 8, sizeof last_and_unit);
    const __m512i unit = _mm512_and_si512(_mm512_set1_epi32(last_and_unit),
                                          _mm512_set1_epi32(static_cast<int32_t>(0xffff0000)));
    const __m512i column = _mm512_setr_epi32(0, 0, 0, 1, 1, 1, 2, 2, 2, 0, 0, 0, 0, 0, 0, 0);
    const __m512 spread = _mm512_maskz_permutexvar_ps(nine, column, _mm512_castps128_ps512(x));
    const auto* sixteen = reinterpret_cast<const __m256i*>(block->entry);
    const __m512i entries = _mm512_maskz_cvtepi16_epi32(nine, _mm256_loadu_si256(sixteen));
    sums_ = _mm512_fmadd_ps(_mm512_maskz_cvtepi32_ps(nine, entries),
                            spread * _mm512_castsi512_ps(unit), sums_);
  }
  Lanes total() const {
    const __m128 first = quarter<0>(), next = quarter<1>(), last = quarter<2>();
    const __m128i second =
        _mm_alignr_epi8(_mm_castps_si128(next), _mm_castps_si128(first), 3 * sizeof(float));
    return first + _mm_castsi128_ps(second) + _mm_shuffle_ps(next, last, _MM_SHUFFLE(0, 0, 3, 2));
  }

 private:
  template <int k>
  __m128 quarter() const {
    return _mm512_maskz_extractf32x4_ps(0xf, sums_, k);
  }

  static constexpr __mmask16 nine = 0x1ff;  // the others are what follows a block
  __m512 sums_ = _mm512_setzero_ps();
};

}  // namespace

const Sweeps avx512_sweeps = SweepLoops<Products>::table;

}  // namespace repose::linear
#endif
