#pragma once
#include <bit>
#include <string>

namespace repose::surface {

static_assert(std::endian::native == std::endian::little);

/// A number's bytes at the end of others, little endian.
template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace repose::surface
