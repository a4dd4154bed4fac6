#pragma once
#include <mpi.h>

#include "repose/discrete/part.h"

namespace repose::solve {

/// Outcome of the initial equilibrium.
struct Prestress {
  double residual = 0;        ///< largest |F_i| left on a soft-tissue point, N
  double largest_force = 0;   ///< largest |F_i| before: skin tension and weight, N
  double min_rest_ratio = 1;  ///< of springs: smallest rest length over initial length
  bool solid = false;
  double largest_pressure = 0;  ///< of a solid, N/mm²
};

/// State of the tissue when its surfaces were recorded.
struct ReferenceState {
  double turgor = 0;            ///< initial strain of the skin springs; a solid's model has its own
  Vec3 gravity = Vec3::Zero();  ///< N/kg
};

/// The initial equilibrium (docs/theory/initial_equilibrium.md; the paper's sec. 3, Fig. 2): gives
/// the skin springs (set "layer 0") the initial strain τ, l = r_0/(1+τ), and all others with a
/// soft-tissue point the rest lengths whose tensions, smallest in the energy norm, balance skin
/// tension and weight at the initial position: min Σ ½ T_j²/k_j with F = 0, so (A K Aᵀ) μ = −b, T =
/// K Aᵀ μ, l_j = r_j − T⁻¹(T_j). External forces are not balanced: they act. Changes the rest
/// lengths of the model. F is 1e-12 of the largest force before, or what the rounding of lengths
/// leaves where that is more. The recording is read on rank 0 only. Throws InputError
/// naming the springs where a rest length would not be positive, or the point that no spring can
/// hold. Collective.
///
/// For a solid it consists of force densities q of its edges (tension over length) and pressures p
/// of its prisms that balance skin tension and weight, those of least energy Σ q² r⁴/(Y v) + Σ p²
/// V/K with the edges' shares v of the volume, Young's modulus Y and the bulk modulus K: they shift
/// the edges' weights and the prisms' target volumes (docs/theory/continuum.md).
Prestress prestress(MPI_Comm comm, discrete::LocalModel& local_model, ReferenceState as);
/// Balances a model that rank 0 alone reads and has.
Prestress prestress(MPI_Comm comm, model::Model& model, ReferenceState as);

}  // namespace repose::solve
