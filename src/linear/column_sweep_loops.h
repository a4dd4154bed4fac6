#pragma once
#include <cstring>

#include "column_sweeps.h"

/// The loops of sweeps; included by one file a set of instructions, with internal linkage: the
/// linker must never put one's code for another's.
namespace repose::linear {
namespace {

/// Four numbers from anywhere, the last of which belongs to what follows and is not used.
inline Lanes load(const float* numbers) {
  Lanes lanes;
  std::memcpy(&lanes, numbers, sizeof lanes);
  return lanes;
}

inline Lanes times(const float* block, Lanes x) {
  return load(block) * x[0] + load(block + 3) * x[1] + load(block + 6) * x[2];
}

/// `Products`: a sum of products, with add(block, x), which may read 12 bytes behind the block, and
/// total().
template <class Products>
struct SweepLoops {
  /// Σ of the blocks [k, end) of a row with x.
  static Lanes row_product(const SweptLevel& level, int64_t k, int64_t end, const Lanes* x) {
    Products products;
    for (; k < end; ++k) products.add(level.block + k, x[level.column[k]]);
    return products.total();
  }

  static void solve_column(const SweptLevel& level, int32_t begin, int32_t end, Lanes* x) {
    for (int32_t i = begin; i < end; ++i) {
      const int64_t above = level.begin[i] + level.left[i];
      if (i > begin) x[i] -= row_product(level, above, above + 1, x);
      x[i] = times(level.inverse + int64_t{9} * i, x[i]);
    }
    for (int32_t i = end - 2; i >= begin; --i) {
      const int64_t right = level.begin[i] + level.left[i] + level.within[i];
      x[i] -= times(level.inverse + int64_t{9} * i, row_product(level, right - 1, right, x));
    }
  }

  static void forward(const SweptLevel& level, const Lanes* b, Lanes* x) {
    for (int64_t c = 0; c < level.columns; ++c) {
      for (int32_t i = level.chain[c]; i < level.chain[c + 1]; ++i)
        x[i] = b[i] - row_product(level, level.begin[i], level.begin[i] + level.left[i], x);
      solve_column(level, level.chain[c], level.chain[c + 1], x);
    }
  }

  static void residual_of_forward(const SweptLevel& level, const Lanes* x, Lanes* r) {
    for (int32_t i = 0; i < level.own; ++i) {
      const int64_t right = level.begin[i] + level.left[i] + level.within[i];
      r[i] = level.damping[i] * x[i] - row_product(level, right, level.begin[i + 1], x);
    }
  }

  static void backward(const SweptLevel& level, const Lanes* b, Lanes* x) {
    for (int64_t c = level.columns; c-- > 0;) {
      for (int32_t i = level.chain[c]; i < level.chain[c + 1]; ++i) {
        const int64_t column = level.begin[i] + level.left[i];
        x[i] = b[i] + level.damping[i] * x[i] - row_product(level, level.begin[i], column, x) -
               row_product(level, column + level.within[i], level.begin[i + 1], x);
      }
      solve_column(level, level.chain[c], level.chain[c + 1], x);
    }
  }

  static constexpr Sweeps table = {forward, residual_of_forward, backward};
};

}  // namespace
}  // namespace repose::linear
