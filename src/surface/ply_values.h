#pragma once
#include <functional>
#include <vector>

#include "ply.h"

namespace repose::surface {

/// Reads every value of a PLY file's body as a double, element by element; lists included.
class PlyValues {
 public:
  PlyValues(const Content& content, const PlyHeader& header);

  /// One row's values: for each property one number, or the entries of a list.
  using Row = std::vector<std::vector<double>>;
  /// Reads the next element whole. Throws InputError naming the row where the file ends or holds no
  /// number.
  void read(const PlyElement& element,
            const std::function<void(uint64_t row, const Row&)>& receive);

 private:
  double text_value();
  double binary_value(const PlyType& type);
  double value(const PlyType& type) { return text_ ? text_value() : binary_value(type); }
  [[noreturn]] void fail() const;

  const Content& content_;
  size_t position_;
  bool text_, big_endian_;
  std::string place_;
};

}  // namespace repose::surface
