#pragma once
#include <string>

#include "study.h"

namespace repose::tradeoff {

/// Returns the difference from the other variants of its study: "lmvm, 0.01 mm", "6 layers",
/// "penalty".
std::string label(const Variant& variant);

}  // namespace repose::tradeoff
