#pragma once
#include "repose/base/comparison.h"
#include "repose/model/model.h"
#include "repose/model/motion.h"
#include "repose/model/step.h"

namespace repose::check {

/// Whether what a step says of contact follows from the model and the positions: gaps to bodies; no
/// pull but where points slide; no pressure across a gap wider than the step's displacement error;
/// nothing deeper than its penetration; forces along the bodies' normals, pressure times area,
/// where a point touches one body only and no side of a cut.
void check_contact(const model::Model& model, const model::PrescribedMotion& motion,
                   const model::StepNumbers& numbers, const model::StepRows& rows,
                   base::Comparison& comparison);

}  // namespace repose::check
