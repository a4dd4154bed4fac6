#pragma once
#include <array>
#include <cstddef>

#include "repose/base/geometry.h"

namespace repose::base {

/// Numbers in a value: those of a vector or a tuple, else 1.
template <class Value>
constexpr size_t components = 1;
template <>
inline constexpr size_t components<Vec3> = 3;
template <class T, size_t n>
constexpr size_t components<std::array<T, n>> = n;

}  // namespace repose::base
