#pragma once
#include <hdf5.h>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "repose/base/error.h"

/// HDF5 identifiers as owners, and HDF5's failures as exceptions.
namespace repose::base {

/// HDF5 reported a failure; the text is its innermost reason, in one line. Callers that know the
/// file and the dataset turn it into an InputError.
class Hdf5Error : public InternalError {
 public:
  using InternalError::InternalError;
};

/// Throws Hdf5Error with the reason on top of HDF5's error stack. Not collective.
[[noreturn]] void throw_hdf5_error();

/// Returns what an HDF5 function returned (hid_t, herr_t, htri_t, …); throws where it is negative.
template <class Code>
Code check_hdf5(Code code) {
  if (code < 0) throw_hdf5_error();
  return code;
}

/// Owns one HDF5 identifier; move-only. `Close` is the closing function of its kind.
template <herr_t (*Close)(hid_t)>
class Hdf5Handle {
 public:
  Hdf5Handle() = default;
  explicit Hdf5Handle(hid_t id) : id_(check_hdf5(id)) {}  ///< takes over; throws if negative
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, none)) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Hdf5Handle() {
    if (id_ >= 0) Close(id_);
  }
  operator hid_t() const { return id_; }
  /// Closes now and throws if that fails (data may still have been on their way to the disk).
  void close() {
    if (id_ >= 0) check_hdf5(Close(std::exchange(id_, none)));
  }

 private:
  static constexpr hid_t none = -1;
  hid_t id_ = none;
};

using Hdf5File = Hdf5Handle<H5Fclose>;
using Hdf5Group = Hdf5Handle<H5Gclose>;
using Hdf5Dataset = Hdf5Handle<H5Dclose>;
using Hdf5Attribute = Hdf5Handle<H5Aclose>;
using Hdf5Object = Hdf5Handle<H5Oclose>;
using Hdf5Space = Hdf5Handle<H5Sclose>;
using Hdf5Type = Hdf5Handle<H5Tclose>;
using Hdf5Properties = Hdf5Handle<H5Pclose>;

/// Returns whether a file is HDF5 by its signature.
bool is_hdf5(const std::filesystem::path& file);

/// Opens, serially, for reading. HDF5's own error printing is switched off from here on.
Hdf5File open_hdf5(const std::filesystem::path& file);

/// Creates or empties a file, serially, in the format of HDF5 1.10 and without time stamps.
Hdf5File create_hdf5(const std::filesystem::path& file);

/// Opens an existing file for writing through MPI-IO. Collective.
Hdf5File open_hdf5(const std::filesystem::path& file, MPI_Comm comm);

/// Creates a group without time stamps. Collective where the file is.
Hdf5Group create_hdf5_group(hid_t place, const char* name);

/// Returns whether there is something at a path whose parent exists.
bool hdf5_has(hid_t file, const std::string& path);

/// A dataset or an attribute of an open file, read the same way. Failures of HDF5 are Hdf5Error;
/// what the format does not allow is an InputError whose text begins with `where`.
class StoredArray {
 public:
  /// `where`: file and path, as a message names it.
  StoredArray(Hdf5Dataset dataset, std::string where);
  StoredArray(Hdf5Attribute attribute, std::string where);

  /// Returns the length along each axis; empty for a single value.
  const std::vector<int64_t>& shape() const { return shape_; }
  /// Returns the number of values that are read: the product of the lengths, or of the selection.
  int64_t size() const;
  /// Selects rows of a dataset that has an axis, for all reads that follow.
  void select_rows(int64_t begin, int64_t rows);
  /// Returns all values, row-major: the last index runs fastest. Throws InputError unless a double
  /// holds each exactly.
  std::vector<double> numbers() const;
  /// Returns all values, row-major. Throws InputError unless they are integers that fit.
  std::vector<int64_t> whole_numbers() const;
  /// Returns all values, row-major. Throws InputError unless they are strings.
  std::vector<std::string> strings() const;

 private:
  void inspect();
  void read(hid_t memory_type, void* data) const;
  std::vector<std::string> variable_strings() const;
  std::vector<std::string> fixed_strings() const;
  [[noreturn]] void refuse_type(const char* expected) const;

  Hdf5Dataset dataset_;
  Hdf5Attribute attribute_;
  Hdf5Type type_;
  Hdf5Space space_;
  std::vector<int64_t> shape_;
  std::string where_;
};

}  // namespace repose::base
