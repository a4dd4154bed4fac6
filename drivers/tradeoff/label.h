#pragma once
#include <string>

#include "study.h"

namespace repose::tradeoff {

/// What differs from the other ways of its study: "lmvm, 0.01 mm", "6 layers", "penalty".
std::string label(const Way& way);

}  // namespace repose::tradeoff
