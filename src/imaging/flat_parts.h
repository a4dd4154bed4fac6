#pragma once
#include <vector>

#include "repose/surface/surface.h"

namespace repose::imaging {

using surface::Surface;

/// Returns a flag for each triangle [T]: 1 in connected parts of at least `area` mm² that lie
/// within 0.5 mm of a plane and face as it does (within 18°): where a scan ends, or a table. O(T)
/// but for parts that are nearly as large and not flat.
std::vector<char> flat_parts(const Surface& surface, double area);

}  // namespace repose::imaging
