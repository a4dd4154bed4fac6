#pragma once
#include "repose/discrete/function.h"

namespace repose::paper {

struct PolakRibiereSettings {
  double line_tolerance = 2e-4;    ///< of the place of a line's minimum
  double value_tolerance = 1e-14;  ///< ends where an iteration lowers the value by no more of it
  int64_t max_iterations = 1000000;
};

struct PolakRibiereOutcome {
  double value = 0;
  int64_t iterations = 0;
};

/// Conjugate gradients of Polak and Ribière (1969) with Brent's line minimization, the algorithm
/// of Teschner, Girod & Girod (2000) after Numerical Recipes (Press et al., sec. 10.6):
///     h ← g + γ h,   γ = (g − g_old) · g / (g_old · g_old),   g = −∇Φ,
/// with γ from every line's minimum, found from values of Φ alone. Every value and every value with
/// gradient is one evaluation. Changes `displacement` in place. Collective.
PolakRibiereOutcome polak_ribiere(discrete::Function& function, Vec displacement,
                                  const PolakRibiereSettings& settings = {});

double dot(Vec x, Vec y);  ///< collective

}  // namespace repose::paper
