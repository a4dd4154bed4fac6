#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "repose/model/model.h"

/// Nodal averaging of the dilatation (Bonet & Burton 1998, "A simple average nodal pressure
/// tetrahedral element for incompressible and nearly incompressible dynamic explicit
/// applications"): every prism gives a sixth of its volume to each of its points, and a point has
/// the energy ½ e²/C with
///     e = Σ (v − V)/6,   C = Σ V/(6 λ)   over the prisms around it,
/// which is ½ λ (J − 1)² per volume of J averaged, for prisms of one λ. Where they differ one
/// pressure e/C is in balance on all of them.
namespace repose::mechanics {

/// The prisms of a part in its order, and what its points resist a change of volume with.
struct NodalVolumes {
  std::vector<std::array<int32_t, 6>> points;  ///< [M] or empty: volumes are not averaged
  std::vector<double> rest_volume;             ///< [M] V, mm³
  std::vector<double> stiffness;               ///< [P] 1/C, N/mm⁵
  int64_t counted = 0;                         ///< points [0, counted): their energy counts here
  bool empty() const { return points.empty(); }
};

/// Of `part`, whose first `owned` points are counted here. A point's C is right where all prisms
/// around it are in the part.
NodalVolumes make_nodal_volumes(const model::Model& part, int64_t owned);

/// [M] The derivative of the energy by the volume of each prism, N/mm².
std::vector<double> nodal_slopes(const NodalVolumes& nodal, std::span<const Vec3> position);

double nodal_energy(const NodalVolumes& nodal, std::span<const Vec3> position);  ///< counted, N·mm

/// Adds weight · the gradient; returns the energy counted (N·mm, unweighted).
double add_nodal_gradient(const NodalVolumes& nodal, std::span<const Vec3> position, double weight,
                          std::span<Vec3> gradient);

/// Adds weight · (∂²/∂x²) d, exact.
void add_nodal_action(const NodalVolumes& nodal, std::span<const Vec3> position, double weight,
                      std::span<const Vec3> direction, std::span<Vec3> product);

/// What couples all points of the prisms around a point, beyond the prisms' blocks (hessian.h): its
/// curvature is stiffness · Σ g gᵀ.
struct NodalGradient {
  std::vector<int32_t> points;
  std::vector<Vec3> gradient;  ///< ∂e/∂x, mm²
};

/// [P] Of points before `owned`, whose prisms are all in the part; the others' are empty.
std::vector<NodalGradient> nodal_gradients(const NodalVolumes& nodal, int64_t owned,
                                           std::span<const Vec3> position);

/// φ′ of every prism of a solid, N/mm²: by how much its energy beyond ½ μ |F|² grows with its
/// volume, averaged or not; minus a pressure. [M]
std::vector<double> volume_slopes(const model::Model& model, std::span<const Vec3> position);

}  // namespace repose::mechanics
