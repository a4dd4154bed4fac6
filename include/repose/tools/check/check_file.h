#pragma once
#include <string>

#include "repose/tools/check/comparison.h"

namespace repose::tools::check {

/// Recomputes every number of a result file from its model and its positions,
/// and compares, to 1e-9. InputError where the file is no result, or holds none. Serial.
Comparison check_file(const std::string& file);

}  // namespace repose::tools::check
