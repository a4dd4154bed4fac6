#pragma once
#include <cstdint>

#include "repose/linear/column_level.h"

/// The loops of ColumnLevel, in one table for each set of instructions.
namespace repose::linear {

/// A level's arrays, as they are described there.
struct SweptLevel {
  int32_t own;
  int64_t columns;
  const int32_t* chain;
  const int64_t* begin;
  const int32_t* column;
  const int32_t *left, *within;
  const PackedBlock* block;  // and what can be read behind the last one
  const float *damping, *inverse;
};

/// As the functions of ColumnLevel.
struct Sweeps {
  void (*forward)(const SweptLevel& level, const Lanes* b, Lanes* x);
  void (*residual_of_forward)(const SweptLevel& level, const Lanes* x, Lanes* r);
  void (*backward)(const SweptLevel& level, const Lanes* b, Lanes* x);
};

extern const Sweeps plain_sweeps;
#ifdef __x86_64__
extern const Sweeps avx2_sweeps, avx512_sweeps;
#endif

}  // namespace repose::linear
