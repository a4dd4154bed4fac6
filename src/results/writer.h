#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/base/hdf5.h"

namespace repose::results {

/// Writing to an open HDF5 file. Datasets are contiguous, without fill values and time stamps, so a
/// file's bytes depend on its content only; failures are Hdf5Error. File types are little-endian.

/// The numbers of an array of numbers, vectors or tuples, row by row.
template <class Value>
auto flat(const std::vector<Value>& values) {
  if constexpr (std::is_enum_v<Value>)
    return reinterpret_cast<const std::underlying_type_t<Value>*>(values.data());
  else if constexpr (std::is_arithmetic_v<Value>)
    return values.data();
  else
    return values.empty() ? nullptr : values[0].data();
}

/// Shape of so many rows of a kind of value.
template <class Value>
std::vector<hsize_t> shape_of(size_t rows) {
  if (base::components < Value >> 1) return {rows, base::components<Value>};
  return {rows};
}

/// HDF5's types of a number: in a file, little-endian, and in memory.
template <class Number>
std::pair<hid_t, hid_t> stored_type() {
  if constexpr (std::is_same_v<Number, double>) return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE};
  if constexpr (std::is_same_v<Number, int64_t>) return {H5T_STD_I64LE, H5T_NATIVE_INT64};
  if constexpr (std::is_same_v<Number, int32_t>) return {H5T_STD_I32LE, H5T_NATIVE_INT32};
  if constexpr (std::is_same_v<Number, int8_t>) return {H5T_STD_I8LE, H5T_NATIVE_INT8};
  if constexpr (std::is_same_v<Number, uint8_t>) return {H5T_STD_U8LE, H5T_NATIVE_UINT8};
}

void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 std::pair<hid_t, hid_t> type, const void* values);
/// Writes a whole dataset from one process; without values creates it only.
template <class Number>
void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 const Number* values) {
  write_array(place, name, shape, stored_type<Number>(), values);
}
template <class Value>
void write_array(hid_t place, const std::string& name, const std::vector<Value>& values) {
  write_array(place, name, shape_of<Value>(values.size()), flat(values));
}
/// Strings of the fixed length of the longest.
void write_strings(hid_t place, const std::string& name, const std::vector<std::string>& values);

void write_attribute(hid_t object, const char* name, std::pair<hid_t, hid_t> type,
                     const base::Hdf5Space& space, const void* values);
/// One number or string, or several numbers, as an attribute. Collective where the file is.
void write_attribute(hid_t object, const char* name, const std::string& value);
template <class Number>
requires std::is_arithmetic_v<Number>
void write_attribute(hid_t object, const char* name, Number value) {
  write_attribute(object, name, stored_type<Number>(), base::Hdf5Space(H5Screate(H5S_SCALAR)),
                  &value);
}
template <class Number>
void write_attribute(hid_t object, const char* name, const std::vector<Number>& values) {
  const hsize_t size = values.size();
  write_attribute(object, name, stored_type<Number>(),
                  base::Hdf5Space(H5Screate_simple(1, &size, nullptr)), values.data());
}

/// A dataset of the same file and the row of a virtual one at which it begins.
struct VirtualPiece {
  std::string path;
  hsize_t first;
};
/// A dataset of the given shape that stores nothing but where its rows are: `pieces`, of one type
/// and at least one, by paths from the root. Rows of none are NaN, −1 of integers. MPI-IO can make
/// it and not read it.
void write_virtual(hid_t place, const std::string& name, const std::vector<VirtualPiece>& pieces,
                   const std::vector<hsize_t>& shape);

/// Creates a dataset of `rows` × `columns` doubles (columns 0: one-dimensional) that all ranks will
/// write. Collective where the file is.
base::Hdf5Dataset create_rows(hid_t place, const std::string& name, int64_t rows, int64_t columns);

/// Writes rows `mine` of a dataset of numbers, row by row in `values`, of the HDF5 type
/// `memory_type`. Collective over `comm`; in pieces
/// that fit MPI's int counts. A rank that fails continues to the end before it throws, so that all
/// can agree on the outcome afterwards.
void write_rows(MPI_Comm comm, const base::Hdf5Dataset& dataset, const base::Slab& mine,
                const void* values, hid_t memory_type = H5T_NATIVE_DOUBLE);

}  // namespace repose::results
