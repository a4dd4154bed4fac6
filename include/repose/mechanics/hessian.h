#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/mechanics/energy.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"

/// Analytic Hessians of the terms as 3×3 blocks.
namespace repose::mechanics {

/// Form of the Hessian: the exact one, or a positive semidefinite one that leaves out what can be
/// negative (the transverse stiffness T/r of a compressed spring, the curvature of v itself; of a
/// solid as much of that as its edges do not outweigh).
enum class Curvature { exact, semidefinite };

/// ∂²E/∂q∂q of a spring with d = q − p: T′ u uᵀ + (T/r)(1 − u uᵀ), N/mm. The blocks of its two
/// points are +K, +K and −K, −K. Where r = 0 and the direction is undefined, T/r is taken as T′ so
/// that the block stays finite and isotropic.
struct SpringStiffness {
  double along;   ///< T′
  double across;  ///< T/r
  Vec3 u;
  Mat3 block() const {
    const double more = along - across;
    const double xy = more * u.x() * u.y(), xz = more * u.x() * u.z(), yz = more * u.y() * u.z();
    Mat3 k;
    k << across + more * u.x() * u.x(), xy, xz, xy, across + more * u.y() * u.y(), yz, xz, yz,
        across + more * u.z() * u.z();
    return k;
  }
};

template <int p>
SpringStiffness spring_stiffness(const Vec3& d, double k0, double rest_length,
                                 double inverse_reference, Curvature curvature) {
  const double r = d.norm(), s = r - rest_length;
  const double along = spring_tangent<p>(s, k0, inverse_reference);
  if (r == 0) return {along, along, Vec3::Zero()};
  const double across = spring_tension<p>(s, k0, inverse_reference) / r;
  const bool left_out = curvature == Curvature::semidefinite && across < 0;
  return {along, left_out ? 0.0 : across, d / r};
}

template <int p>
Mat3 spring_block(const Vec3& d, double k0, double rest_length, double inverse_reference,
                  Curvature curvature) {
  return spring_stiffness<p>(d, k0, rest_length, inverse_reference, curvature).block();
}

/// Calls visit(spring number, K) for each spring of the loop.
template <class Visit>
void for_each_spring_block(const SpringLoop& loop, std::span<const Vec3> position, double scale,
                           Curvature curvature, Visit&& visit) {
  with_exponent(loop.exponent, [&]<int p>() {
    for (int64_t e = 0; e < loop.size(); ++e) {
      const auto [i, j] = loop.points[e];
      visit(e, spring_block<p>(position[j] - position[i], scale * loop.stiffness[e],
                               loop.rest_length[e], loop.inverse_reference[e], curvature));
    }
  });
}

/// ∂(K w)/∂d, N/mm²: how the stiffness of a spring turns what acts on a fixed vector w, the third
/// derivative of E: a ((u·w) 1 + u wᵀ + w uᵀ) + (T″ − 3 a) (u·w) u uᵀ with a = (T′ − T/r)/r.
/// Nothing where r = 0.
template <int p>
Mat3 spring_third(const Vec3& d, const Vec3& w, double k0, double rest_length,
                  double inverse_reference) {
  const double r = d.norm(), s = r - rest_length;
  if (r == 0) return Mat3::Zero();
  const Vec3 u = d / r;
  const double slope = spring_tangent_slope<p>(s, k0, inverse_reference), along = u.dot(w);
  const double a = (spring_tangent<p>(s, k0, inverse_reference) -
                    spring_tension<p>(s, k0, inverse_reference) / r) /
                   r;
  const Mat3 mixed = u * w.transpose();
  return a * (along * Mat3::Identity() + mixed + mixed.transpose()) +
         (slope - 3 * a) * along * u * u.transpose();
}

/// Calls visit(spring number, scale · ∂(K w)/∂d), w the difference of `direction` along the spring.
template <class Visit>
void for_each_spring_third(const SpringLoop& loop, std::span<const Vec3> position, double scale,
                           std::span<const Vec3> direction, Visit&& visit) {
  with_exponent(loop.exponent, [&]<int p>() {
    for (int64_t e = 0; e < loop.size(); ++e) {
      const auto [i, j] = loop.points[e];
      visit(e, spring_third<p>(position[j] - position[i], direction[j] - direction[i],
                               scale * loop.stiffness[e], loop.rest_length[e],
                               loop.inverse_reference[e]));
    }
  });
}

/// The volume term of one prism, and what it takes from averaged volumes: φ′, and a curvature that
/// stands for theirs.
struct PrismTerm {
  double compliance, target_volume;
  double nodal_slope = 0, nodal_curvature = 0;
};

/// Its 6×6 blocks: φ″ ∇v∇vᵀ + φ′ ∇²v, with |φ′| at most `max_slope`.
using PrismBlocks = std::array<std::array<Mat3, 6>, 6>;
PrismBlocks prism_blocks(const std::array<Vec3, 6>& corners, const PrismTerm& term,
                         const Weights& weights, double max_slope);

/// [M] What |φ′| of each prism may be for the blocks to be semidefinite with the rest of the
/// Hessian: nothing where there are springs. A solid's ½ μ |F|² + φ′ J has the curvatures μ ± φ′ σ,
/// σ the singular values of F (Smith, de Goes & Kim 2018, "Stable Neo-Hookean Flesh Simulation"),
/// so that it is μ / σ_max, with F in the middle of the prism, between `initial` and `position`.
std::vector<double> semidefinite_slopes(const PrismLoop& loop, std::span<const Vec3> initial,
                                        std::span<const Vec3> position);

/// Calls visit(prism number, blocks) for each prism of the loops. `max_slope` [M], or empty for
/// the exact Hessian, of which averaged volumes have more (nodal_gradients); else λ/V ∇v∇vᵀ of each
/// prism is in their place, which is never less (Cauchy & Schwarz), with λ at most 20 μ: a
/// multigrid that resists volume more corrects shear worse (docs/theory/linear_solver.md).
template <class Visit>
void for_each_prism_block(const Loops& loops, std::span<const Vec3> position,
                          const Weights& weights, std::span<const double> max_slope,
                          Visit&& visit) {
  constexpr double max_bulk = 20;  // times μ
  if (weights.volume == VolumeTerm::none) return;
  const PrismLoop& prisms = loops.prisms;
  const std::vector<double> nodal = nodal_slopes(loops.nodal, position);
  for (int64_t e = 0; e < prisms.size(); ++e) {
    PrismTerm term{prisms.compliance[e], prisms.target_volume[e]};
    if (!nodal.empty()) term.nodal_slope = nodal[loops.nodal.place[prisms.row[e]]];
    if (!nodal.empty() && !max_slope.empty())
      term.nodal_curvature = std::min(prisms.nodal_modulus[e], max_bulk * prisms.shear_modulus[e]) /
                             prisms.rest_volume[e];
    const double maximum = max_slope.empty() ? std::numeric_limits<double>::max() : max_slope[e];
    visit(e, prism_blocks(base::pick(position, prisms.points[e]), term, weights, maximum));
  }
}

}  // namespace repose::mechanics
