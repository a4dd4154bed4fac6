#pragma once
#include <optional>
#include <string>

#include "repose/discrete/objective.h"
#include "repose/solve/repose.h"

/// The search for a rest position in the part of the tissue that feels what moves.
namespace repose::solve {

/// Whether a part of the tissue is searched, and why.
struct RegionChoice {
  bool part = false;
  std::string why;  ///< on rank 0
};

/// What find_in_region does under the settings' extent. `model` on rank 0 only. Collective.
RegionChoice choose_region(MPI_Comm comm, const model::Model& model, const Settings& settings);

/// find_repose, but only columns of an active region are unknowns: at first those nearer to what
/// moves than displacements are expected to be felt. The region grows, and the rest position is
/// found again from the present state, until the effect of the forces that hold the points at its
/// border is below what the accuracy leaves them.
///
/// That effect is part of every step's displacement_error: with the forces ∇Φ of the whole model on
/// the held points, a Newton step H⁻¹∇Φ is solved for on a band of columns on either side of the
/// border; its largest 3-vector, times the Minimiser's safety factor 2, over 1 − ρ, is added. ρ, at
/// most ½, is how much of these forces (sums of |F|) the band passes on to the tissue around it
/// instead of to bone; a band that passes on more is made wider. (In a bar on an elastic foundation
/// whose displacements fall by e over a length a, a band of half-width m a takes tanh m of the
/// displacement and ρ = 1/cosh m, so that the quotient, coth(m/2) of the displacement, is never too
/// small.) Steps on the way scale the last such error by the largest force; it is nothing where
/// that is the initial state's rounding.
///
/// Points left out are at their initial positions in all steps, with the forces that hold them.
/// Returns nothing where the settings' extent is the whole, nothing moves, or (automatic) it would
/// not pay. Throws InputError where extent `region` is impossible because most
/// of the tissue is not at rest initially. Collective.
std::optional<Summary> find_in_region(MPI_Comm comm, const model::Model& model,
                                      const Settings& settings, const Start& start,
                                      base::Stages& stages, const Receiver& receive);

/// The energies, forces and volumes of a step at the objective's last update. Collective.
void measure(discrete::Objective& objective, model::StepNumbers& numbers);

}  // namespace repose::solve
