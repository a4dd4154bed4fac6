#include "ply_values.h"

#include <algorithm>
#include <cstring>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::surface {
namespace {

template <class Number>
double as_number(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  return static_cast<double>(number);
}

double decode(const std::string& type, const char* bytes) {
  if (type == "char") return as_number<int8_t>(bytes);
  if (type == "uchar") return as_number<uint8_t>(bytes);
  if (type == "short") return as_number<int16_t>(bytes);
  if (type == "ushort") return as_number<uint16_t>(bytes);
  if (type == "int") return as_number<int32_t>(bytes);
  if (type == "uint") return as_number<uint32_t>(bytes);
  return type == "float" ? as_number<float>(bytes) : as_number<double>(bytes);
}

}  // namespace

PlyValues::PlyValues(const Content& content, const PlyHeader& header)
    : content_(content),
      position_(header.bytes),
      text_(header.format == "ascii"),
      big_endian_(header.format == "binary_big_endian") {}

void PlyValues::read(const PlyElement& element,
                     const std::function<void(uint64_t row, const Row&)>& receive) {
  Row row(element.properties.size());
  for (uint64_t number = 0; number < element.count; ++number) {
    place_ = fmt::format("{} {} of {}", base::shown(element.name), number, element.count);
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

double PlyValues::text_value() {
  constexpr auto blanks = " \t\v\f\r\n";
  const std::string& bytes = content_.bytes;
  const size_t begin = std::min(bytes.find_first_not_of(blanks, position_), bytes.size());
  position_ = std::min(bytes.find_first_of(blanks, begin), bytes.size());
  const auto number = base::parse_number(std::string_view(bytes).substr(begin, position_ - begin));
  if (!number) fail();
  return *number;
}

double PlyValues::binary_value(const PlyType& type) {
  if (type.bytes > content_.bytes.size() - position_) fail();
  char bytes[8];
  std::memcpy(bytes, content_.bytes.data() + position_, type.bytes);
  if (big_endian_) std::reverse(bytes, bytes + type.bytes);
  position_ += type.bytes;
  return decode(type.name, bytes);
}

void PlyValues::fail() const {
  base::refuse("{}: truncated or damaged: {} lies beyond the end or holds no number ({} bytes)",
               content_.file.string(), place_, content_.bytes.size());
}

}  // namespace repose::surface
