#include "repose/base/text.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

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

std::string shown(std::string_view text) {
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

std::string wanted_number(bool whole, std::string_view unit, const Range& range,
                          const std::vector<std::string>& words) {
  std::string result = whole ? "a whole number" : "a number";
  if (!unit.empty()) result.append(" of ").append(unit);
  if (const std::string limits = range.text(); !limits.empty()) result.append(", ").append(limits);
  for (const std::string& word : words) result.append(", or ").append(word);
  return result;
}

}  // namespace repose::base
