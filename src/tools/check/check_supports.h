#pragma once
#include "repose/model/motion.h"
#include "repose/tools/check/comparison.h"

namespace repose::tools::check {

/// Energy and forces of a model's elastic supports, from their numbers alone.
struct SupportState {
  int64_t point;
  double energy;  ///< N mm
  Vec3 force;     ///< N, on the point
  double noise;   ///< N; times the relative rounding of positions, that of the force
};
/// Evaluates the supports at a load and the positions of all points (mm).
std::vector<SupportState> evaluate_supports(const model::Model& model,
                                            const model::PrescribedMotion& motion, double load,
                                            const std::vector<Vec3>& position);

/// States whether elastic supports hold points of soft tissue where these begin.
void check_supports(const model::Model& model, Comparison& comparison);

}  // namespace repose::tools::check
