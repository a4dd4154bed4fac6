
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/surface/ply.h"

namespace repose::surface {
PlyValues::PlyValues(const Content& content, const PlyHeader& header)
    : content_(content),
      position_(header.bytes),
      text_(header.format == "ascii"),
      big_endian_(header.format == "binary_big_endian") {}

void PlyValues::read(const PlyElement& element,
                     const std::function<void(uint64_t row, const Row&)>& receive) {
  Row row(element.properties.size());
  for (uint64_t number = 0; number < element.count; ++number) {
    place_ = fmt::format("{} {} of {}", base::quote(element.name), number, element.count);
    for (size_t p = 0; p < row.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      const double entries = property.list_size ? value(*property.list_size) : 1;
      if (!(entries >= 0 && entries <= static_cast<double>(content_.bytes.size()))) fail();
      row[p].clear();
      for (auto left = static_cast<size_t>(entries); left > 0; --left)
        row[p].push_back(value(property.type));
    }
    receive(number, row);
  }
}

double PlyValues::text_value(const PlyType& type) {
  constexpr double largest = std::numeric_limits<uint32_t>::max();  // of PLY's integers
  constexpr auto blanks = " \t\v\f\r\n";
  const std::string& bytes = content_.bytes;
  const size_t begin = std::min(bytes.find_first_not_of(blanks, position_), bytes.size());
  position_ = std::min(bytes.find_first_of(blanks, begin), bytes.size());
  const auto number = base::parse_number(std::string_view(bytes).substr(begin, position_ - begin));
  const auto is_integer = [](double n) { return n == std::floor(n) && std::abs(n) <= largest; };
  if (!number || (!type.is_real() && !is_integer(*number))) fail();
  return *number;
}

double PlyValues::binary_value(const PlyType& type) {
  if (type.bytes > content_.bytes.size() - position_) fail();
  const char* const stored = content_.bytes.data() + position_;
  position_ += type.bytes;
  if (!big_endian_) return type.decode(stored);
  std::array<char, 8> bytes;
  std::reverse_copy(stored, stored + type.bytes, bytes.begin());
  return type.decode(bytes.data());
}

void PlyValues::fail() const {
  if (text_) {
    const std::string_view all = content_.bytes;
    const auto line =
        1 + std::count(all.begin(), all.begin() + static_cast<int64_t>(position_), '\n');
    base::refuse("{}:{}: truncated or damaged: {} holds no number here; export it again",
                 content_.file.string(), line, place_);
  }
  base::refuse(
      "{}: truncated or damaged: {} lies beyond the end of the file ({} bytes); export it again",
      content_.file.string(), place_, content_.bytes.size());
}

}  // namespace repose::surface
