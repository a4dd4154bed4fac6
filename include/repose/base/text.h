#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Numbers as a person types them, and text as a message may show it.
namespace repose::base {

/// The finite decimal number that `text` is as a whole ("8", "-0.5", "1e-3"); nothing for
/// anything else: other text, a unit behind it, nan, inf, or a number no double can hold.
std::optional<double> parse_number(std::string_view text);

/// The whole number that `text` is as a whole; nothing for anything else ("4.0", "4 mm").
std::optional<int64_t> parse_integer(std::string_view text);

/// `text` in single quotes, fit for a one-line message: control characters become '?', and what
/// goes past 60 bytes becomes "...".
std::string quote(std::string_view text);

/// ASCII letters in lower case, whatever the locale.
std::string lower(std::string_view text);

/// `name` without the first of the endings that it ends with, in upper or lower case.
std::string without_ending(std::string_view name, const std::vector<std::string>& endings);

/// The next line from `position` on, without its end (LF, CRLF or CR), which is stepped over.
std::string_view next_line(std::string_view text, size_t& position);

/// `text` without blanks and line ends around it.
std::string trimmed(std::string_view text);

/// The blank-separated words of a line.
std::vector<std::string_view> words(std::string_view line);

/// The values a number may have.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_excluded = false;

  static constexpr Range above(double min) { return {.min = min, .min_excluded = true}; }
  static constexpr Range at_least(double min) { return {.min = min}; }
  static constexpr Range between(double min, double max) { return {.min = min, .max = max}; }

  bool contains(double value) const;
  /// "> 0", "≥ 0", "0 … 1", "> 0 and ≤ 1", or empty where every number may stand.
  std::string text() const;
};

/// Describes a valid number for a message: "a number of mm, > 0, or auto". `words` may stand in its
/// place; `unit` may be empty.
std::string expected_number(bool whole, std::string_view unit, const Range& range,
                            const std::vector<std::string>& words);

/// Least number of insertions, deletions, substitutions and swaps of neighbors that turn `a` into
/// `b` (optimal string alignment), upper and lower case taken as one. Works on bytes.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known name nearest to `name` (the first of several); empty when nothing is known.
std::string nearest(std::string_view name, const std::vector<std::string>& known);

}  // namespace repose::base
