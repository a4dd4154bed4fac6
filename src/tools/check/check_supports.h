#pragma once
#include "check_adhesion.h"

namespace repose::tools::check {

/// Evaluates a model's elastic supports, from their numbers alone, at a load and the positions of
/// all points (mm).
std::vector<PointForce> evaluate_supports(const model::Model& model,
                                          const model::PrescribedMotion& motion, double load,
                                          const std::vector<Vec3>& position);

/// States whether elastic supports hold points of soft tissue where these begin.
void check_supports(const model::Model& model, Comparison& comparison);

}  // namespace repose::tools::check
