#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/base/hdf5.h"

namespace repose::results {

/// Rows and columns a dataset must have; `any` rows: as many as there are. No columns: [rows].
struct Shape {
  static constexpr int64_t any = -1;
  int64_t rows;
  std::vector<int64_t> columns;
};

/// Reads named datasets and attributes of one HDF5 file, serially. Everything it refuses is an
/// InputError that names file and dataset: missing, a group or other thing in its place, another
/// shape, a type that would lose information, a number out of range or not finite, unreadable
/// (truncated file, unknown filter). Numeric types that convert without loss are taken; strings
/// may be of fixed or variable length.
class Reader {
 public:
  /// Datasets of numbers are read whole, or the slab (base::slab) of one of `ranks`: rows in a
  /// refusal then count from the slab's first.
  explicit Reader(const std::filesystem::path& file, int rank = 0, int ranks = 1);

  const std::string& file() const { return name_; }
  /// Returns whether something of that path is there, at the end of links that lead somewhere.
  bool has(const std::string& path) const;
  int64_t links(const std::string& group) const;
  template <class... Args>
  [[noreturn]] void refuse(const std::string& path, fmt::format_string<Args...> what,
                           Args&&... args) const {
    base::refuse("{}: {}: {}", name_, path, fmt::format(what, std::forward<Args>(args)...));
  }

  /// Returns the number of rows of a dataset that was read, whole.
  int64_t rows(const std::string& path) const;
  std::vector<double> numbers(const std::string& path, const Shape& shape) const;
  std::vector<Vec3> vectors(const std::string& path, int64_t rows) const;
  std::vector<std::string> names(const std::string& path) const;

  /// Whole numbers, each within the range of Int.
  template <class Int>
  std::vector<Int> integers(const std::string& path, int64_t rows) const {
    return narrow<Int>(path, whole_numbers(path, {rows, {}}));
  }
  template <size_t K>
  std::vector<std::array<int64_t, K>> tuples(const std::string& path, int64_t rows) const {
    const std::vector<int64_t> flat = whole_numbers(path, {rows, {static_cast<int64_t>(K)}});
    std::vector<std::array<int64_t, K>> result(flat.size() / K);
    for (size_t i = 0; i < flat.size(); ++i) result[i / K][i % K] = flat[i];
    return result;
  }

  /// Any of these, by the type of the values.
  template <class Value>
  void read(const std::string& path, int64_t rows, std::vector<Value>& values) const {
    if constexpr (std::is_enum_v<Value>) {
      values.clear();
      for (const auto number : integers<std::underlying_type_t<Value>>(path, rows))
        values.push_back(static_cast<Value>(number));
    } else if constexpr (std::is_integral_v<Value>) {
      values = integers<Value>(path, rows);
    } else if constexpr (std::is_same_v<Value, double>) {
      values = numbers(path, {rows, {}});
    } else if constexpr (std::is_same_v<Value, Vec3>) {
      values = vectors(path, rows);
    } else {
      values = tuples<base::components<Value>>(path, rows);
    }
  }

  bool has_attribute(const std::string& object, const char* attribute) const;
  double number(const std::string& object, const char* attribute) const;
  /// Anything but NaN.
  double number_or_infinity(const std::string& object, const char* attribute) const;
  int64_t integer(const std::string& object, const char* attribute) const;
  std::string text(const std::string& object, const char* attribute) const;
  Vec3 vector(const std::string& object, const char* attribute) const;

 private:
  std::vector<int64_t> whole_numbers(const std::string& path, const Shape& shape) const;
  /// Opens a dataset of numbers of this shape and selects the rows that are read.
  base::StoredArray open_rows(const std::string& path, const Shape& shape, int64_t& rows) const;
  /// Opens attribute `name` of `object`, requires `count` values and reads them with `read`.
  template <class Value>
  std::vector<Value> attribute_values(const std::string& object, const char* name, int64_t count,
                                      std::vector<Value> (base::StoredArray::*read)() const) const;

  template <class Int>
  std::vector<Int> narrow(const std::string& path, const std::vector<int64_t>& wide) const {
    std::vector<Int> result(wide.size());
    for (size_t i = 0; i < wide.size(); ++i) {
      if (wide[i] < std::numeric_limits<Int>::min() || wide[i] > std::numeric_limits<Int>::max())
        refuse(path, "row {} is {}, expected {} to {}", i, wide[i],
               static_cast<int64_t>(std::numeric_limits<Int>::min()),
               static_cast<int64_t>(std::numeric_limits<Int>::max()));
      result[i] = static_cast<Int>(wide[i]);
    }
    return result;
  }

  std::string name_;
  base::Hdf5File file_;
  int rank_, ranks_;
};

}  // namespace repose::results
