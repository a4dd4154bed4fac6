#pragma once
#include "study.h"

namespace repose::tradeoff {

/// The scene as it stands, by the first method and the second of the accuracies.
Variant usual_variant(const Plan& plan);
/// All ways of a plan, those of one model one after another.
std::vector<Variant> variants_of(const Plan& plan);

}  // namespace repose::tradeoff
