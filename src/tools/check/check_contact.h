#pragma once
#include "repose/model/model.h"
#include "repose/model/motion.h"
#include "repose/model/step.h"
#include "repose/tools/check/comparison.h"

namespace repose::tools::check {

/// Checks what a step states about contact against the bodies' own triangles and closed forms
/// (obstacle.h), which share nothing with the distances that the solver uses. Gaps must be those of
/// the file format's definition, to meshes within 1e-5 mm. The penetration must be that of the
/// deepest stated gap, the exact penetration that into the triangles within 1e-6 mm.
/// Forces must be pressure times area along the body's normal where that is well defined, never
/// pull except where points slide, and not act across a gap wider than the step's displacement
/// error. Pressures must be those that the forces determine, by the gradient of the smoothed
/// distances, but at the sides of cuts. Gaps between the sides of cuts come from the solver's own
/// surfaces.
void check_contact(const model::Model& model, const model::PrescribedMotion& motion,
                   const model::StepNumbers& numbers, const model::StepRows& rows,
                   Comparison& comparison);

}  // namespace repose::tools::check
