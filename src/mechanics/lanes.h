#pragma once
#include <immintrin.h>

#include <cstdint>
#include <utility>

#include "repose/mechanics/triple.h"

/// Numbers of four elements of a run, or of four each of two runs, that go through the same
/// arithmetic at once. Everything here has internal linkage: each file that includes this is
/// compiled for instructions of its own, and the linker must never put one's code for another's.
namespace repose::mechanics {
namespace {

template <int runs>
struct Registers;
template <>
struct Registers<1> {
  using Real [[gnu::vector_size(32)]] = double;
  using Integer [[gnu::vector_size(32)]] = int64_t;
};
template <>
struct Registers<2> {
  using Real [[gnu::vector_size(64)]] = double;
  using Integer [[gnu::vector_size(64)]] = int64_t;
};
using FourReals = Registers<1>::Real;
/// Four numbers a run.
template <int runs>
struct Lanes {
  using Real = typename Registers<runs>::Real;
  using Integer = typename Registers<runs>::Integer;
  Real v;

  Lanes() = default;
  Lanes(Real values) : v(values) {}
  Lanes(double value) : v(Real{} + value) {}
  Lanes operator-() const { return -v; }
  friend Lanes operator+(Lanes a, Lanes b) { return a.v + b.v; }
  friend Lanes operator-(Lanes a, Lanes b) { return a.v - b.v; }
  friend Lanes operator*(Lanes a, Lanes b) { return a.v * b.v; }
  friend Lanes operator/(Lanes a, Lanes b) { return a.v / b.v; }
  double sum() const {
    double total = 0;
    for (int k = 0; k < 4 * runs; ++k) total += v[k];
    return total;
  }
};

/// Lanes (p, q, r, s) of each run, out of those of a (0 … 3) and b (4 … 7).
template <int p, int q, int r, int s, int runs>
Lanes<runs> pick(Lanes<runs> a, Lanes<runs> b) {
  const auto shuffled = [&]<int... lane>(std::integer_sequence<int, lane...>) {
    constexpr int from[] = {p, q, r, s};
    return __builtin_shufflevector(
        a.v, b.v, (lane / 4 * 4 + from[lane % 4] % 4 + from[lane % 4] / 4 * 4 * runs)...);
  };
  return shuffled(std::make_integer_sequence<int, 4 * runs>());
}
template <int p, int q, int r, int s, int runs>
Lanes<runs> pick(Lanes<runs> a) {
  return pick<p, q, r, s>(a, a);
}

/// Four numbers from wherever they are, and back.
inline FourReals load(const double* from) {
  FourReals values;
  __builtin_memcpy(&values, from, sizeof values);
  return values;
}
inline void store(FourReals values, double* to) { __builtin_memcpy(to, &values, sizeof values); }

/// Four numbers from each of the addresses.
inline Lanes<1> load(const double* const (&from)[1]) { return load(from[0]); }
inline Lanes<2> load(const double* const (&from)[2]) {
  const FourReals a = load(from[0]), b = load(from[1]);
  return Registers<2>::Real(__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7));
}

/// 4 · runs consecutive numbers, or as many of them as there are and 0 for the others.
template <int runs>
Lanes<runs> load_row(const double* from, int64_t there) {
  Lanes<runs> values = 0;
  if (there >= 4 * runs)
    __builtin_memcpy(&values, from, sizeof values);
  else
    __builtin_memcpy(&values, from, there * sizeof *from);
  return values;
}

template <int runs>
Lanes<runs> load_row(const double* from) {
  return load_row<runs>(from, 4 * runs);
}
template <int runs>
void store_row(Lanes<runs> values, double* to) {
  __builtin_memcpy(to, &values, sizeof values);
}

/// The lanes of run k alone.
inline FourReals part(Lanes<1> values, int) { return values.v; }
inline FourReals part(Lanes<2> values, int k) {
  return k == 0 ? FourReals(__builtin_shufflevector(values.v, values.v, 0, 1, 2, 3))
                : FourReals(__builtin_shufflevector(values.v, values.v, 4, 5, 6, 7));
}

/// All bits set in the first lanes, as many as the row's number, none in the others.
constexpr int64_t first_lanes[5][4] = {
    {0, 0, 0, 0}, {-1, 0, 0, 0}, {-1, -1, 0, 0}, {-1, -1, -1, 0}, {-1, -1, -1, -1}};

/// Which lanes hold an element.
template <int runs>
struct Active {
  typename Lanes<runs>::Integer bits;
  explicit Active(const int (&counts)[runs]) {
    const double* from[runs];
    for (int k = 0; k < runs; ++k)
      from[k] = reinterpret_cast<const double*>(first_lanes[counts[k]]);
    bits = typename Lanes<runs>::Integer(load(from).v);
  }
  /// The values there, and exactly 0 elsewhere.
  Lanes<runs> only(Lanes<runs> values) const {
    using Real = typename Lanes<runs>::Real;
    return Real(typename Lanes<runs>::Integer(values.v) & bits);
  }
};

/// √x and 1/√x of numbers ≥ 0; 0 counts as the smallest normal number.
template <int runs>
struct Root {
  Lanes<runs> root, inverse;
  explicit Root(Lanes<runs> x);
};

#if defined(__AVX512F__) && defined(__AVX512VL__)
inline Lanes<1> estimated_inverse_root(Lanes<1> x) { return FourReals(_mm256_rsqrt14_pd(x.v)); }
inline Lanes<2> estimated_inverse_root(Lanes<2> x) {
  return Registers<2>::Real(_mm512_maskz_rsqrt14_pd(0xff, x.v));
}

/// Newton's method from 14 bits: the divider, which would take most of the time, is not used.
template <int runs>
Root<runs>::Root(Lanes<runs> x) {
  constexpr double smallest = 2.2250738585072014e-308;
  x = x.v < smallest ? Lanes<runs>(smallest).v : x.v;
  const Lanes<runs> rough = estimated_inverse_root(x);
  const Lanes<runs> better = rough * (1.5 - 0.5 * x * rough * rough);
  const Lanes<runs> first = x * better;
  root = first + 0.5 * better * (x - first * first);
  inverse = better + better * (1.0 - root * better);
}
#else
inline Lanes<1> square_root(Lanes<1> x) { return FourReals(_mm256_sqrt_pd(x.v)); }

template <int runs>
Root<runs>::Root(Lanes<runs> x) {
  constexpr double smallest = 2.2250738585072014e-308;
  x = x.v < smallest ? Lanes<runs>(smallest).v : x.v;
  root = square_root(x);
  inverse = 1.0 / root;
}
#endif

}  // namespace
}  // namespace repose::mechanics
