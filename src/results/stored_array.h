#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "repose/base/hdf5.h"

namespace repose::results {

/// A dataset or an attribute of an open file, read the same way. Failures of HDF5 are Hdf5Error;
/// what the format does not allow is an InputError whose text begins with `where`.
class StoredArray {
 public:
  /// `where`: file and path, as a message names it.
  StoredArray(base::Hdf5Dataset dataset, std::string where);
  StoredArray(base::Hdf5Attribute attribute, std::string where);

  const std::vector<int64_t>& shape() const { return shape_; }
  int64_t size() const;
  std::vector<double> numbers() const;
  std::vector<int64_t> whole_numbers() const;
  std::vector<std::string> strings() const;

 private:
  void inspect();
  void read(hid_t memory_type, void* data) const;
  std::vector<std::string> variable_strings() const;
  std::vector<std::string> fixed_strings() const;
  [[noreturn]] void refuse_type(const char* expected) const;

  base::Hdf5Dataset dataset_;
  base::Hdf5Attribute attribute_;
  base::Hdf5Type type_;
  base::Hdf5Space space_;
  std::vector<int64_t> shape_;
  std::string where_;
};

}  // namespace repose::results
