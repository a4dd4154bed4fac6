#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

/// Additions to a result that is complete before and after. A result that has one already is left
/// alone. For one process; InputError where the disk refuses.
namespace repose::results {

/// The skin that a scene names, in the place of which another was solved, at the end of a run.
struct GivenSkin {
  const std::vector<Vec3>& points;         ///< mm, [vertices]
  const std::vector<Triangle>& triangles;  ///< of rows of points
  const std::vector<Vec3>& displacement;   ///< mm, [vertices]
  const std::vector<double>& solved;       ///< [vertices] 1 over the solved skin, 0 beyond
};
void add_given_skin(const std::filesystem::path& file, const GivenSkin& skin);

/// Adds the end-of-run summary, a row for each line of the text. Returns why not, where the disk
/// refuses, in place of an error: the run has its result.
std::string add_summary(const std::filesystem::path& file, const std::string& text);
/// Adds the summary of another result, if that has one.
void copy_summary(const std::filesystem::path& from, const std::filesystem::path& file);

}  // namespace repose::results
