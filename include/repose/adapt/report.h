#pragma once
#include <string>

#include "repose/adapt/ladder.h"

namespace repose::adapt {

/// Lines of the closing table about a nested iteration; only rank 0 has them.
std::string describe_ladder(const Ladder& ladder);

/// A line about the last coarse model where it was solved in place of the scene's own, to `wanted`
/// mm; only rank 0 has it.
std::string describe_choice(const Ladder& ladder, double wanted);

}  // namespace repose::adapt
