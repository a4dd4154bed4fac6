#pragma once
#include "repose/model/model.h"
#include "repose/model/motion.h"
#include "repose/model/step.h"
#include "repose/tools/check/comparison.h"

namespace repose::tools::check {

/// Checks what a step states about contact against the bodies' own triangles and closed forms
/// (obstacle.h), which share nothing with the distances that the solver uses. The solver smooths
/// meshes on a grid: a stated gap below 3 mm must lie between the exact one and the exact one
/// averaged in the same way, within a tenth of the spacing and 0.05 mm. The penetration must be
/// that of the deepest stated gap, the exact penetration that of the triangles within 1e-4 mm.
/// Forces must be pressure times area along the body's normal where that is well defined, never
/// pull except where points slide, and not act across a gap wider than the step's displacement
/// error. Pressures must be those that the forces determine, by the gradient of the smoothed
/// distances, but at the sides of cuts. Gaps between the sides of cuts come from the solver's own
/// surfaces.
void check_contact(const model::Model& model, const model::PrescribedMotion& motion,
                   const model::StepNumbers& numbers, const model::StepRows& rows,
                   Comparison& comparison);

}  // namespace repose::tools::check
