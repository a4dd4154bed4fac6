#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
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

/// Stacks of prisms: the lower triangle of each is the upper one of the next.
struct PrismStacks {
  int64_t prisms = 0;  ///< in each stack
  int64_t count = 0;   ///< stacks
  int64_t first_prism =
      0;  ///< that of the first stack, which those below it and other stacks follow
  int64_t first_point = 0;  ///< in NodalVolumes::points: three a triangle, from the top down
};

/// The prisms of a part, stack by stack, and the stiffness of its points against a change of
/// volume.
struct NodalVolumes {
  std::vector<PrismStacks> stacks;    ///< by their number of prisms; empty: no volume is averaged
  std::vector<int32_t> points;        ///< of their triangles
  std::vector<int64_t> place;         ///< [M] of a prism of the part in the arrays below
  std::vector<double> rest_volume;    ///< [M] V, mm³
  std::vector<double> own_stiffness;  ///< [M] (κ − λ)/V, N/mm⁵: the part that is not averaged
  std::vector<double> own_target;     ///< [M] the volume that it draws v to, mm³
  std::vector<double> counted_share;  ///< [M] of its energy that counts here: 1 or 0
  std::vector<double> stiffness;      ///< [P] 1/C, N/mm⁵
  int64_t counted = 0;                ///< points [0, counted): their energy counts here
  bool empty() const { return stacks.empty(); }

  /// Calls visit(place, points) for each prism.
  template <class Visit>
  void for_each_prism(Visit&& visit) const {
    for (const PrismStacks& of : stacks)
      for (int64_t k = 0; k < of.count * of.prisms; ++k) {
        std::array<int32_t, 6> corners;
        std::copy_n(points.begin() + of.first_point + 3 * (k + k / of.prisms), 6, corners.begin());
        visit(of.first_prism + k, corners);
      }
  }
};

/// Returns the volume that the part of a prism's energy that is not averaged draws it to, mm³: one
/// with the same pressure at rest.
double own_target_volume(const model::Prisms& prisms, int64_t row);

/// Returns the stiffness of each point against a change of its averaged volume, N/mm⁵, where λ of
/// the prisms is at most `max_bulk` times μ: [P], right where all prisms around a point are in the
/// part.
std::vector<double> nodal_stiffness(const model::Model& part,
                                    double max_bulk = std::numeric_limits<double>::infinity());

/// Returns the averaged volumes of `part`, whose first `owned` points and `owned_prisms` prisms are
/// counted here. A point's C is right where all prisms around it are in the part.
NodalVolumes make_nodal_volumes(const model::Model& part, int64_t owned, int64_t owned_prisms);

/// Returns the derivative of the averaged energy by the volume of each prism, N/mm²: [M], by
/// places.
std::vector<double> nodal_slopes(const NodalVolumes& nodal, std::span<const Vec3> position);

/// Returns the derivative of a prism's energy that is not averaged by its volume, N/mm².
inline double own_slope(const NodalVolumes& nodal, int64_t place, double volume) {
  return nodal.own_stiffness[place] * (volume - nodal.own_target[place]);
}

double nodal_energy(const NodalVolumes& nodal, std::span<const Vec3> position);  ///< counted, N·mm

/// Adds weight · the gradient of the averaged energy and of the prisms' own one; returns both as
/// they are counted (N·mm, unweighted). The gradient is right at points around which the part has
/// all prisms.
double add_nodal_gradient(const NodalVolumes& nodal, std::span<const Vec3> position, double weight,
                          std::span<Vec3> gradient);

/// Adds weight · (∂²/∂x²) d of the same energies, exact. `slopes` are nodal_slopes at `position`.
void add_nodal_action(const NodalVolumes& nodal, std::span<const Vec3> position,
                      std::span<const double> slopes, double weight,
                      std::span<const Vec3> direction, std::span<Vec3> product);

/// Coupling of all points of the prisms around a point, beyond the prisms' blocks (hessian.h): its
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
