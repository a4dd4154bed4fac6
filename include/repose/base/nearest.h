#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// What a person probably meant when a name is unknown.
namespace repose::base {

/// Least number of insertions, deletions, substitutions and swaps of neighbours that turn `a` into
/// `b` (optimal string alignment), upper and lower case taken as one. Works on bytes.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known name nearest to `name` (the first of several); empty when nothing is known.
std::string nearest(std::string_view name, const std::vector<std::string>& known);

}  // namespace repose::base
