#pragma once
#include <filesystem>
#include <vector>

#include "repose/base/geometry.h"

namespace repose::results {

/// The skin that a scene names, in the place of which another was solved, at the end of a run.
struct GivenSkin {
  const std::vector<Vec3>& points;         ///< mm, [vertices]
  const std::vector<Triangle>& triangles;  ///< of rows of points
  const std::vector<Vec3>& displacement;   ///< mm, [vertices]
  const std::vector<double>& solved;       ///< [vertices] 1 over the solved skin, 0 beyond
};

/// Adds the group given_skin to a result, which is complete before and after. A result that has one
/// is left alone. For one process; InputError where the disk refuses.
void add_given_skin(const std::filesystem::path& file, const GivenSkin& skin);

}  // namespace repose::results
