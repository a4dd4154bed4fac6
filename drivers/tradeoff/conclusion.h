#pragma once
#include <string>
#include <vector>

#include "study.h"

namespace repose::tradeoff {

/// Returns one paragraph for a person: what accuracy costs, what layers and mesh leave, and which
/// of them to improve first. `usual` is the scene as it stands.
std::string conclude(const std::vector<Measurement>& found, const Variant& usual);

}  // namespace repose::tradeoff
