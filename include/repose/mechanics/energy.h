#pragma once
#include <span>

#include "repose/mechanics/loops.h"

/// Energies and their gradients as kernels on plain arrays, the same code for one rank, many, the
/// tests and the benchmark. `position` is [P] mm over the local points; gradients are added to
/// `gradient` [P] (N), for every local point, fixed or not: the caller keeps the rows it needs.
namespace repose::mechanics {

/// Adds scale · ∂f_e/∂x to `gradient` and returns Σ E(s) over the counted springs (N·mm, unscaled).
double add_spring_gradient(const SpringLoop& loop, std::span<const Vec3> position, double scale,
                           std::span<Vec3> gradient);

/// Adds scale · ∂/∂x of ½ Σ w |x_i − x_j|², a solid's edges, to `gradient`; returns the sum over
/// the counted ones (N·mm, unscaled). As the function is quadratic, this is also its Hessian's
/// action on `position`.
double add_edge_gradient(const EdgeLoop& loop, std::span<const Vec3> position, double scale,
                         std::span<Vec3> gradient);

/// Adds the volume term's gradient; returns its value over the counted prisms (N·mm or mm⁶ ·
/// weight).
double add_prism_gradient(const PrismLoop& loop, std::span<const Vec3> position,
                          const Weights& weights, std::span<Vec3> gradient);

/// Adds the gradient of the volume terms, averaged volumes included.
double add_volume_gradient(const Loops& loops, std::span<const Vec3> position,
                           const Weights& weights, std::span<Vec3> gradient);

/// Value of a prism's volume term and its first two derivatives by v.
struct VolumeLaw {
  double value, slope, curvature;
};
VolumeLaw volume_law(const Weights& weights, double volume, double compliance,
                     double target_volume);

/// Σ scale · (∂²Φ/∂x²) d of all terms, added to `product`: the action of the exact Hessian.
/// `nodal_slopes`: those at `position` (nodal_volumes.h); empty where volumes are not averaged.
void add_hessian_action(const Loops& loops, std::span<const Vec3> position, const Weights& weights,
                        std::span<const Vec3> direction, std::span<Vec3> product,
                        std::span<const double> nodal_slopes,
                        std::span<const double> max_slope = {});

/// Totals of a state of the tissue over the counted elements (to be summed over ranks).
struct Totals {
  double spring_energy = 0;     ///< f_e of springs, N·mm
  double solid_energy = 0;      ///< edges' and prisms' of a solid, to a constant, N·mm
  double fixed_energy = 0;      ///< and of those without a soft-tissue point
  double term_energy = 0;       ///< of further terms
  double volume_squares = 0;    ///< f_v, mm⁶
  double penalty_unit = 0;      ///< Σ ½ (v−v_0)²/v_0, mm³ (times κ: N·mm)
  double volume_error_max = 0;  ///< max |v/v_0 − 1|
  int64_t inverted = 0;         ///< prisms with v ≤ 0
};
Totals totals(const Loops& loops, std::span<const Vec3> position, BonePoses poses = {});

}  // namespace repose::mechanics
