#pragma once
#include <vector>

#include "check_terms.h"
#include "repose/model/model.h"
#include "repose/model/step.h"

namespace repose::tools::check {

/// A number computed again, and the size its difference from another computation is measured
/// against: its own, or, where terms cancel, a billion times what their rounding leaves.
struct Recomputed {
  double value = 0, scale = 0;
};

/// All of a step that follows from the model and the positions (docs/theory/model.md, Eqs. 6 to
/// 12).
struct RecomputedStep {
  model::StepRows rows;
  std::vector<Vec3> displacement;  ///< [N] mm
  /// Sizes that differences of the arrays are measured against.
  struct Scale {
    double position = 0, displacement = 0, elongation = 0;  ///< mm
    double tension = 0, force = 0;                          ///< N
    double stress = 0;                                      ///< N/mm²
    double ratio = 0, stretch = 0;
  } scale;
  Recomputed f_e, potential, f_f, f_v, penalty, objective, gradient_max, volume_error_max;
  int64_t inverted_prisms = 0;  ///< v ≤ 0, of those with a soft-tissue point
};

/// Computes a step again by plain serial loops over the whole model, sharing with the solver only
/// the formulas of spring_law.h and prism_geometry.h. Of `claimed` it takes what defines the
/// objective: functional, volume, lambda, bulk_modulus, epsilon; of `rows`, the position.
/// `films` are those of the model.
RecomputedStep recompute(const model::Model& model, const model::PrescribedMotion& motion,
                         const model::StepNumbers& claimed, const model::StepRows& rows,
                         const std::vector<Film>& films);

}  // namespace repose::tools::check
