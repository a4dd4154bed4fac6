#pragma once
#include <cstdint>
#include <vector>

namespace repose::base {

/// The values at `rows`, in their order.
template <class T>
std::vector<T> pick(const std::vector<T>& values, const std::vector<int64_t>& rows) {
  std::vector<T> picked;
  picked.reserve(rows.size());
  for (const int64_t row : rows) picked.push_back(values[row]);
  return picked;
}

}  // namespace repose::base
