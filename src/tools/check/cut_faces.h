#pragma once
#include <span>
#include <vector>

#include "repose/model/model.h"

namespace repose::tools::check {

/// Gap of one place on the first side of a cut to the second side.
struct CutGap {
  int64_t point;            ///< at which the place counts
  std::vector<double> gap;  ///< mm, at the nearest foot, first, and at others as near
};

/// Returns the gaps between the sides of all cuts, as docs/reference/formats.md defines them.
/// Nothing here is shared with the solver's surfaces: splines are sums over their controls one by
/// one, and the nearest point is found by a search without derivatives.
std::vector<CutGap> cut_gaps(const model::CutFaces& cuts, std::span<const Vec3> position);

}  // namespace repose::tools::check
