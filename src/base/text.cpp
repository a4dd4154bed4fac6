#include "repose/base/text.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace repose::base {

namespace {

template <class Number>
std::optional<Number> parse_whole(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  const auto value = parse_whole<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int64_t> parse_integer(std::string_view text) { return parse_whole<int64_t>(text); }

std::string quote(std::string_view text) {
  constexpr std::size_t longest = 60;
  std::string result(text.substr(0, longest));
  for (char& c : result)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '?';
  return fmt::format("'{}{}'", result, text.size() > longest ? "..." : "");
}

bool Range::contains(double value) const {
  return (min_excluded ? value > min : value >= min) && value <= max;
}

std::string Range::text() const {
  const bool low = std::isfinite(min), high = std::isfinite(max);
  if (low && high && !min_excluded) return fmt::format("{:g} … {:g}", min, max);
  std::string result = low ? fmt::format("{} {:g}", min_excluded ? ">" : "≥", min) : "";
  if (high) result += fmt::format("{}≤ {:g}", low ? " and " : "", max);
  return result;
}

std::string expected_number(bool whole, std::string_view unit, const Range& range,
                            const std::vector<std::string>& words) {
  std::string result = whole ? "a whole number" : "a number";
  if (!unit.empty()) result.append(" of ").append(unit);
  if (const std::string limits = range.text(); !limits.empty()) result.append(", ").append(limits);
  for (const std::string& word : words) result.append(", or ").append(word);
  return result;
}

std::string trimmed(std::string_view text) {
  constexpr const char* blanks = " \t\r\n\v\f";
  const size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return "";
  return std::string(text.substr(begin, text.find_last_not_of(blanks) - begin + 1));
}

std::string lower(std::string_view text) {
  std::string lowered(text);
  for (char& c : lowered)
    if (c >= 'A' && c <= 'Z') c += 'a' - 'A';
  return lowered;
}

std::string without_ending(std::string_view name, const std::vector<std::string>& endings) {
  for (const std::string& ending : endings)
    if (lower(name).ends_with(ending))
      return std::string(name.substr(0, name.size() - ending.size()));
  return std::string(name);
}

std::string_view next_line(std::string_view text, size_t& position) {
  const size_t begin = position;
  const size_t end = std::min(text.find_first_of("\r\n", begin), text.size());
  position = text.substr(end, 2) == "\r\n" ? end + 2 : std::min(end + 1, text.size());
  return text.substr(begin, end - begin);
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> found;
  constexpr auto blanks = " \t\v\f";
  for (size_t begin = line.find_first_not_of(blanks); begin != line.npos;) {
    const size_t end = std::min(line.find_first_of(blanks, begin), line.size());
    found.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(blanks, end);
  }
  return found;
}

std::size_t edit_distance(std::string_view a_text, std::string_view b_text) {
  // Long input is garbage, not a misspelled name: the distance is only taken over its beginning.
  constexpr std::size_t longest = 200;
  const std::string a = lower(a_text.substr(0, longest)), b = lower(b_text.substr(0, longest));
  std::vector<std::size_t> two_before(b.size() + 1), before(b.size() + 1), row(b.size() + 1);
  std::iota(before.begin(), before.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t differ = a[i - 1] == b[j - 1] ? 0 : 1;
      row[j] = std::min({before[j] + 1, row[j - 1] + 1, before[j - 1] + differ});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], two_before[j - 2] + 1);
    }
    two_before.swap(before);
    before.swap(row);
  }
  return before.back();
}

std::string nearest(std::string_view name, const std::vector<std::string>& known) {
  if (known.empty()) return {};
  return *std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return edit_distance(name, a) < edit_distance(name, b);
  });
}

}  // namespace repose::base
