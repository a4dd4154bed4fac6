#pragma once
#include <array>

#include "repose/base/geometry.h"

namespace repose::mechanics {

/// The state of a prism of a solid in its middle.
struct PrismState {
  Vec3 stretch;      ///< principal stretches, the singular values of F, largest first
  double pressure;   ///< N/mm², minus the mean of the principal stresses, compression positive
  double von_mises;  ///< N/mm²
};

/// Returns pressure, von Mises stress and stretches for the Cauchy stress σ = μ F Fᵀ / J + φ′
/// (docs/theory/continuum.md) with F in the middle of the prism, μ `shear` and φ′ `volume_slope`, κ
/// (v − t)/V (nodal_volumes.h), N/mm²; force densities of an initial equilibrium are not in it.
/// Zero stress at rest.
PrismState prism_state(double shear, double volume_slope, const std::array<Vec3, 6>& before,
                       const std::array<Vec3, 6>& now);

}  // namespace repose::mechanics
