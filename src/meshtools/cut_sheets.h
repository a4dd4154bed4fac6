#pragma once
#include <vector>

#include "repose/meshtools/osteotomy.h"

namespace repose::meshtools {

using surface::Surface;

/// Content on the two sides of a sheet: the bone in front of a cut, behind it, or the gap that
/// the saw leaves.
enum class Side { ahead, behind, kerf, none };

struct CutSheet {
  Surface surface;
  Side front, back;
};

/// The sheets that make the cuts of a plan in a bone: one for each plane and the surface, with a
/// kerf two, at half its width on either side, and the wall between their borders. Unbounded planes
/// reach beyond the bone. `shift` mm moves each along its normal. Throws InputError where a
/// surface intersects itself at that width.
std::vector<CutSheet> cut_sheets(const Surface& bone, const Osteotomy& plan, double shift);

}  // namespace repose::meshtools
