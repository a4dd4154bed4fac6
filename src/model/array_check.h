#pragma once
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/geometry.h"

namespace repose::model {

/// Values that the numbers of an array may have.
struct Limits {
  double minimum, maximum;
  const char* unit;
  bool above = false;       ///< the least value is not allowed itself
  const char* remedy = "";  ///< behind the range

  bool contains(double value) const {
    return std::isfinite(value) && value <= maximum && (above ? value > minimum : value >= minimum);
  }
  std::string text() const {
    const std::string range = minimum == 0
                                  ? fmt::format("a finite number{} and at most {:g}",
                                                above ? " above 0" : ", 0 or more", maximum)
                                  : fmt::format("{} to {}", minimum, maximum);
    return *remedy ? fmt::format("{}: {}", range, remedy) : range;
  }
};

/// Checks arrays of /model one by one; a refusal names the file, the array, its row, the value and
/// the allowed range (InputError).
class ArrayCheck {
 public:
  explicit ArrayCheck(const std::string& file) : file_(file) {}

  void rows(const std::string& name, size_t rows, size_t expected) const {
    if (rows != expected) refuse(name, "has {} rows, expected {}, one for each", rows, expected);
  }
  void number(const std::string& name, size_t row, double value, const Limits& limits) const {
    if (!limits.contains(value))
      refuse(name, "row {} is {} {}, expected {}", row, value, limits.unit, limits.text());
  }
  void numbers(const std::string& name, const std::vector<double>& values, size_t expected,
               const Limits& limits) const {
    rows(name, values.size(), expected);
    for (size_t i = 0; i < values.size(); ++i) number(name, i, values[i], limits);
  }
  void vectors(const std::string& name, const std::vector<Vec3>& values, size_t expected,
               const Limits& limits) const {
    rows(name, values.size(), expected);
    for (size_t i = 0; i < values.size(); ++i)
      for (const double value : values[i]) number(name, i, value, limits);
  }
  void integer(const std::string& name, size_t row, int64_t value, int64_t first,
               int64_t last) const {
    if (value < first || value > last)
      refuse(name, "row {} is {}, expected {} to {}", row, value, first, last);
  }
  template <class Int>
  void integers(const std::string& name, const std::vector<Int>& values, size_t expected,
                int64_t first, int64_t last) const {
    rows(name, values.size(), expected);
    for (size_t i = 0; i < values.size(); ++i)
      integer(name, i, static_cast<int64_t>(values[i]), first, last);
  }
  /// Rows of K indices below `count`.
  template <size_t K>
  void indices(const std::string& name, const std::vector<std::array<int64_t, K>>& values,
               size_t count) const {
    for (size_t i = 0; i < values.size(); ++i)
      for (const int64_t index : values[i])
        integer(name, i, index, 0, static_cast<int64_t>(count) - 1);
  }
  /// Rows of K indices that differ from one another.
  template <size_t K>
  void different(const std::string& name, const std::vector<std::array<int64_t, K>>& values) const {
    constexpr const char* number = K == 2 ? "two" : K == 3 ? "three" : "six";
    for (size_t i = 0; i < values.size(); ++i)
      if (std::set<int64_t>(values[i].begin(), values[i].end()).size() < K)
        refuse(name, "row {} is ({}), expected {} different points; remove it", i,
               fmt::join(values[i], ", "), number);
  }
  template <class... Args>
  [[noreturn]] void refuse(const std::string& name, fmt::format_string<Args...> what,
                           Args&&... args) const {
    base::refuse("{}: /model/{}: {}", file_, name, fmt::format(what, std::forward<Args>(args)...));
  }

 private:
  const std::string& file_;
};

}  // namespace repose::model
