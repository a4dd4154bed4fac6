#pragma once
#include <vector>

#include "check_adhesion.h"
#include "repose/model/motion.h"
#include "repose/results/model_file.h"
#include "repose/tools/check/comparison.h"

namespace repose::tools::check {

/// Compares every number of a stored step with what the model and the stored positions make of it:
/// positions of the points that are not unknown with `motion`, all else with recompute(), of which
/// `films` are those of the model. What only the run itself knows (iterations, evaluations,
/// seconds, displacement_error) is checked for its range.
void check_step(const model::Model& model, const model::PrescribedMotion& motion,
                const results::StoredStep& step, const std::vector<Film>& films,
                Comparison& comparison);

/// Compares the stored rest volumes with the prisms' volumes at the initial positions.
void check_model(const model::Model& model, Comparison& comparison);

}  // namespace repose::tools::check
