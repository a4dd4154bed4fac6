#pragma once
#include <string>

#include "repose/adapt/ladder.h"

namespace repose::adapt {

/// Lines of the closing table about a nested iteration; only rank 0 has them.
std::string describe_ladder(const Ladder& ladder);

}  // namespace repose::adapt
