#pragma once
#include <array>

#include "repose/base/geometry.h"

namespace repose::mechanics {

/// A prism of a solid: its moduli (N/mm²), volume V and target volume t (mm³).
struct SolidPrism {
  double shear, modulus, rest_volume, target_volume;
};

/// The state of a prism of a solid in its middle.
struct PrismState {
  Vec3 stretch;      ///< principal stretches, the singular values of F, largest first
  double pressure;   ///< N/mm², minus the mean of the principal stresses, compression positive
  double von_mises;  ///< N/mm²
};

/// Of the Cauchy stress σ = μ F Fᵀ / J + κ (v − t)/V (docs/theory/continuum.md), with F in the
/// middle of the prism and its volume v by `volume`; force densities of an initial equilibrium are
/// not in it. Zero stress at rest.
PrismState prism_state(const SolidPrism& prism, const std::array<Vec3, 6>& before,
                       const std::array<Vec3, 6>& now);

}  // namespace repose::mechanics
