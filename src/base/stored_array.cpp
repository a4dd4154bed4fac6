#include <cmath>

#include "repose/base/hdf5.h"

namespace repose::base {

namespace {

// Returns true where every value of a floating-point type is a double.
bool fits_double(hid_t type) {
  size_t sign, exponent, exponent_bits, mantissa, mantissa_bits;
  check_hdf5(H5Tget_fields(type, &sign, &exponent, &exponent_bits, &mantissa, &mantissa_bits));
  return exponent_bits <= 11 && mantissa_bits <= 52;
}

std::string describe(hid_t type) {
  const size_t bytes = H5Tget_size(type);
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      return fmt::format("{}-byte {}integers", bytes,
                         H5Tget_sign(type) == H5T_SGN_NONE ? "unsigned " : "");
    case H5T_FLOAT:
      return fmt::format("{}-byte floating-point numbers", bytes);
    case H5T_STRING:
      return "strings";
    case H5T_ENUM:
      return "an enumeration (such as truth values)";
    case H5T_COMPOUND:
      return "compound values (such as complex numbers)";
    default:
      return "neither numbers nor strings";
  }
}

}  // namespace

StoredArray::StoredArray(Hdf5Dataset dataset, std::string where)
    : dataset_(std::move(dataset)),
      type_(H5Dget_type(dataset_)),
      space_(H5Dget_space(dataset_)),
      where_(std::move(where)) {
  inspect();
}

StoredArray::StoredArray(Hdf5Attribute attribute, std::string where)
    : attribute_(std::move(attribute)),
      type_(H5Aget_type(attribute_)),
      space_(H5Aget_space(attribute_)),
      where_(std::move(where)) {
  inspect();
}

void StoredArray::inspect() {
  if (H5Sget_simple_extent_type(space_) == H5S_NULL) refuse("{}: is empty", where_);
  std::vector<hsize_t> extent(check_hdf5(H5Sget_simple_extent_ndims(space_)));
  check_hdf5(H5Sget_simple_extent_dims(space_, extent.data(), nullptr));
  shape_.assign(extent.begin(), extent.end());
}

int64_t StoredArray::size() const { return check_hdf5(H5Sget_select_npoints(space_)); }

void StoredArray::select_rows(int64_t begin, int64_t rows) {
  std::vector<hsize_t> start(shape_.size(), 0), count(shape_.begin(), shape_.end());
  start[0] = begin;
  count[0] = rows;
  check_hdf5(
      H5Sselect_hyperslab(space_, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
}

void StoredArray::read(hid_t memory_type, void* data) const {
  if (size() == 0) return;
  if (attribute_ >= 0) {
    check_hdf5(H5Aread(attribute_, memory_type, data));
    return;
  }
  const auto values = static_cast<hsize_t>(size());
  const Hdf5Space memory(H5Screate_simple(1, &values, nullptr));
  check_hdf5(H5Dread(dataset_, memory_type, memory, space_, H5P_DEFAULT, data));
}

void StoredArray::refuse_type(const char* expected) const {
  refuse("{}: holds {}, expected {}", where_, describe(type_), expected);
}

std::vector<double> StoredArray::numbers() const {
  if (H5Tget_class(type_) == H5T_INTEGER) {
    const std::vector<int64_t> whole = whole_numbers();
    for (size_t i = 0; i < whole.size(); ++i)
      if (std::abs(static_cast<double>(whole[i])) > 9007199254740992.0)
        refuse("{}: value {} is {}, which a double cannot hold exactly", where_, i, whole[i]);
    return {whole.begin(), whole.end()};
  }
  if (H5Tget_class(type_) != H5T_FLOAT || !fits_double(type_))
    refuse_type("numbers of at most double precision");
  std::vector<double> values(size());
  read(H5T_NATIVE_DOUBLE, values.data());
  return values;
}

std::vector<int64_t> StoredArray::whole_numbers() const {
  if (H5Tget_class(type_) != H5T_INTEGER || H5Tget_size(type_) > 8)
    refuse_type("integers of at most 8 bytes");
  std::vector<int64_t> values(size());
  if (H5Tget_sign(type_) != H5T_SGN_NONE) {
    read(H5T_NATIVE_INT64, values.data());
    return values;
  }
  std::vector<uint64_t> unsigned_values(values.size());
  read(H5T_NATIVE_UINT64, unsigned_values.data());
  for (size_t i = 0; i < values.size(); ++i) {
    if (unsigned_values[i] > INT64_MAX)
      refuse("{}: value {} is {}, expected at most {}", where_, i, unsigned_values[i], INT64_MAX);
    values[i] = static_cast<int64_t>(unsigned_values[i]);
  }
  return values;
}

std::vector<std::string> StoredArray::strings() const {
  if (H5Tget_class(type_) != H5T_STRING) refuse_type("strings");
  return check_hdf5(H5Tis_variable_str(type_)) ? variable_strings() : fixed_strings();
}

std::vector<std::string> StoredArray::variable_strings() const {
  std::vector<char*> pointers(size(), nullptr);
  const Hdf5Type memory(H5Tcopy(type_));
  read(memory, pointers.data());
  std::vector<std::string> result;
  for (const char* text : pointers) result.emplace_back(text ? text : "");
  if (!pointers.empty()) check_hdf5(H5Dvlen_reclaim(memory, space_, H5P_DEFAULT, pointers.data()));
  return result;
}

std::vector<std::string> StoredArray::fixed_strings() const {
  const size_t width = H5Tget_size(type_) + 1;
  const Hdf5Type memory(H5Tcopy(H5T_C_S1));
  check_hdf5(H5Tset_size(memory, width));
  check_hdf5(H5Tset_cset(memory, H5Tget_cset(type_)));
  std::vector<char> bytes(size() * width, '\0');
  read(memory, bytes.data());
  std::vector<std::string> result;
  for (int64_t i = 0; i < size(); ++i) result.emplace_back(bytes.data() + i * width);
  return result;
}

}  // namespace repose::base
