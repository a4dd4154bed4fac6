#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "repose/mechanics/nodal_volumes.h"
#include "repose/mechanics/term.h"
#include "repose/model/model.h"
#include "repose/model/step.h"

/// Springs and prisms laid out for the kernels: one loop a law, no branch inside.
namespace repose::mechanics {

/// Springs of one law. Point numbers are local (rows of the position array given to the kernels).
struct SpringLoop {
  int exponent = 2;                            ///< p of the law
  std::vector<std::array<int32_t, 2>> points;  ///< [S]
  std::vector<double> stiffness;               ///< [S] k0, N/mm
  std::vector<double> rest_length;             ///< [S] mm
  std::vector<double> inverse_reference;       ///< [S] 1/s_ref, 1/mm
  int64_t counted = 0;  ///< springs [0, counted) add to energies here, the rest elsewhere
  int64_t size() const { return std::ssize(points); }
};

/// Edges of a solid: pairs of points with a weight of either sign. Edges with the same first point
/// follow each other.
struct EdgeLoop {
  std::vector<std::array<int32_t, 2>> points;  ///< [E] ascending in each edge
  std::vector<double> weight;                  ///< [E] N/mm
  int64_t counted = 0;                         ///< as in SpringLoop
  int64_t size() const { return std::ssize(points); }
};

/// Prisms with at least one soft-tissue point.
struct PrismLoop {
  std::vector<std::array<int32_t, 6>> points;  ///< [M] a0 a1 a2 b0 b1 b2
  std::vector<double> rest_volume;             ///< [M] v_0, mm³
  /// [M] mm³, by which the weight of a penalty is divided: v_0, and for a solid v_0 / κ with κ in
  /// N/mm², so that its weight is 1. κ without what averaged volumes resist with.
  std::vector<double> compliance;
  std::vector<double> shear_modulus;  ///< [M] μ of a solid, N/mm²; else empty
  std::vector<double> nodal_modulus;  ///< [M] λ where volumes are averaged, N/mm²; else empty
  std::vector<double> target_volume;  ///< [M] what the volume term draws v to; v_0 at first
  std::vector<int64_t> row;           ///< [M] the prism's row in the part
  int64_t counted = 0;                ///< as in SpringLoop
  int64_t size() const { return std::ssize(points); }
};

/// All that a rank evaluates.
struct Loops {
  std::vector<SpringLoop> springs;  ///< one a law that occurs, by exponent
  EdgeLoop edges;                   ///< of a solid
  PrismLoop prisms;
  NodalVolumes nodal;           ///< empty where no volume is averaged
  std::vector<TermLoop> terms;  ///< further ones
  EdgeLoop fixed_edges;         ///< of a solid, those without a soft-tissue point, …
  PrismLoop fixed_prisms;       ///< … which only add to its energy
  bool solid() const { return !prisms.shear_modulus.empty() || fixed_prisms.size() > 0; }
};

/// The loops over the springs, prisms and edges of `part` with a soft-tissue point. Of its rows,
/// and of its points, the first `owned_…` are counted here. Elements come in the order of their
/// points in memory. InputError where a further term is not known.
Loops make_loops(const model::Model& part, int64_t owned_springs, int64_t owned_prisms,
                 int64_t owned_edges = 0, int64_t owned_points = 0);

using model::VolumeTerm;

/// Gives the soft-tissue prisms of a solid the λ of `part`, but at most `max_bulk` times μ. What
/// they press with at their rest volumes does not change. Infinity takes the limit back, bit by
/// bit.
void limit_bulk(const model::Model& part, double max_bulk, Loops& loops);

/// Returns the largest λ/μ of the soft-tissue prisms of a solid; 0 where there are none.
double largest_bulk(const model::Model& part, const PrismLoop& loop);

/// An objective: Φ = elastic (f_e + W) + volume term, the latter but for `none` a quadratic of each
/// prism's v − t with t its target volume:
///     paper     weight (t − v)²             (docs/theory/model.md Eq. 10, weight = 1 − λ)
///     penalty   weight ½ (v − t)² / v_0     (weight = κ)
///     material  likewise of a solid         (weight = 1: its prisms have moduli of their own)
struct Weights {
  double elastic = 1;  ///< λ of `paper`, else 1
  VolumeTerm volume = VolumeTerm::none;
  double volume_weight = 0;
};

/// Weights for a solid: its edges, and its prisms with moduli of their own.
inline constexpr Weights solid_weights{1, VolumeTerm::material, 1};

}  // namespace repose::mechanics
