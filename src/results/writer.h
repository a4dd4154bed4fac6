#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "repose/base/agreement.h"
#include "repose/base/geometry.h"
#include "repose/base/hdf5.h"

namespace repose::results {

/// Writing to an open HDF5 file. Datasets are contiguous, without fill values and time stamps, so a
/// file's bytes depend on its content only; failures are Hdf5Error. File types are little-endian.

/// The numbers of vectors or tuples as one array, row by row.
inline const double* flat(const std::vector<Vec3>& vectors) {
  return vectors.empty() ? nullptr : vectors[0].data();
}

template <size_t K>
const int64_t* flat(const std::vector<std::array<int64_t, K>>& tuples) {
  return tuples.empty() ? nullptr : tuples[0].data();
}

/// Writes a whole dataset from one process; without values creates it only.
void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 const double* values);
void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 const int64_t* values);
void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 const int32_t* values);
void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 const int8_t* values);
void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 const uint8_t* values);
/// Strings of the fixed length of the longest.
void write_strings(hid_t place, const std::string& name, const std::vector<std::string>& values);

/// One number or string as an attribute. Collective where the file is.
void write_attribute(hid_t object, const char* name, double value);
void write_attribute(hid_t object, const char* name, int64_t value);
void write_attribute(hid_t object, const char* name, const std::string& value);
void write_attribute(hid_t object, const char* name, const std::vector<double>& values);
void write_attribute(hid_t object, const char* name, const std::vector<int64_t>& values);

/// A dataset of the same file and the row of a virtual one at which it begins.
struct VirtualPiece {
  std::string path;
  hsize_t first;
};
/// A dataset of the given shape that stores nothing but where its rows are: `pieces`, of one type
/// and at least one. Rows of none are NaN, −1 of integers. MPI-IO can make it and not read it.
void write_virtual(hid_t file, hid_t place, const std::string& name,
                   const std::vector<VirtualPiece>& pieces, const std::vector<hsize_t>& shape);

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
