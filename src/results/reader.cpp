#include "reader.h"

#include "repose/base/collective.h"

namespace repose::results {

using base::check_hdf5;
using base::StoredArray;

namespace {

std::string describe_shape(const std::vector<int64_t>& shape) {
  return fmt::format("[{}]", fmt::join(shape, ","));
}

// Returns true where `path` exists and its last link leads to an object.
bool link_resolves(hid_t file, const std::string& path) {
  for (size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string part = path.substr(0, end);
    if (check_hdf5(H5Lexists(file, part.c_str(), H5P_DEFAULT)) == 0) return false;
    if (H5Oexists_by_name(file, part.c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

base::Hdf5File open_result(const std::filesystem::path& file) {
  std::error_code error;
  const std::string result = file.string() + ".h5";
  if (!std::filesystem::exists(file, error))
    base::refuse(
        "{}: no such file; give {}", file.string(),
        std::filesystem::exists(result, error) ? result : "what repose-solve writes, NAME.h5");
  if (std::filesystem::is_directory(file, error))
    base::refuse("{}: is a folder, expected an HDF5 file", file.string());
  try {
    return base::open_hdf5(file);
  } catch (const base::Hdf5Error& reason) {
    base::refuse("{}: cannot be read as an HDF5 file: {}; make it again if it is truncated",
                 file.string(), reason.what());
  }
}

}  // namespace

Reader::Reader(const std::filesystem::path& file, int rank, int ranks)
    : name_(file.string()), file_(open_result(file)), rank_(rank), ranks_(ranks) {}

bool Reader::has(const std::string& path) const {
  try {
    return link_resolves(file_, path);
  } catch (const base::Hdf5Error&) {
    return false;
  }
}

int64_t Reader::links(const std::string& group) const {
  try {
    H5G_info_t info;
    check_hdf5(H5Gget_info_by_name(file_, group.c_str(), &info, H5P_DEFAULT));
    return static_cast<int64_t>(info.nlinks);
  } catch (const base::Hdf5Error& reason) {
    refuse(group, "cannot be read as a group: {}", reason.what());
  }
}

namespace {

/// Runs `read` and turns HDF5's and the memory's failures into a refusal that names the place.
template <class Read>
auto named(const Reader& reader, const std::string& path, Read&& read) {
  try {
    return read();
  } catch (const base::Hdf5Error& reason) {
    reader.refuse(path, "cannot be read: {}", reason.what());
  } catch (const std::bad_alloc&) {
    reader.refuse(path, "is larger than the memory");
  } catch (const std::length_error&) {
    reader.refuse(path, "is larger than the memory");
  }
}

StoredArray open_dataset(hid_t file, const Reader& reader, const std::string& path) {
  if (!reader.has(path)) reader.refuse(path, "is missing");
  const base::Hdf5Object object(H5Oopen(file, path.c_str(), H5P_DEFAULT));
  if (H5Iget_type(object) != H5I_DATASET)
    reader.refuse(path, "is a group or a type, expected a dataset");
  return StoredArray(base::Hdf5Dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT)),
                     fmt::format("{}: {}", reader.file(), path));
}

void require_shape(const Reader& reader, const std::string& path, const StoredArray& array,
                   const Shape& shape) {
  std::vector<int64_t> expected = {shape.rows};
  expected.insert(expected.end(), shape.columns.begin(), shape.columns.end());
  if (shape.rows == Shape::any && !array.shape().empty()) expected[0] = array.shape()[0];
  if (array.shape() == expected) return;
  std::string words = describe_shape(expected);
  if (shape.rows == Shape::any) words.replace(1, words.find_first_of(",]") - 1, "rows");
  reader.refuse(path, "has shape {}, expected {}", describe_shape(array.shape()), words);
}

template <class Numbers>
void require_finite(const Reader& reader, const std::string& path, const Numbers& values,
                    int64_t per_row) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      reader.refuse(path, "row {} holds {}, expected finite numbers",
                    static_cast<int64_t>(i) / per_row, values[i]);
}

std::string attribute_place(const std::string& object, const char* name) {
  return fmt::format("{} attribute {}", object, name);
}

StoredArray open_attribute(hid_t file, const Reader& reader, const std::string& object,
                           const char* name, const std::string& place) {
  if (object != "/" && !reader.has(object)) reader.refuse(object, "is missing");
  const auto exists = check_hdf5(H5Aexists_by_name(file, object.c_str(), name, H5P_DEFAULT));
  if (exists == 0) reader.refuse(place, "is missing");
  return StoredArray(
      base::Hdf5Attribute(H5Aopen_by_name(file, object.c_str(), name, H5P_DEFAULT, H5P_DEFAULT)),
      fmt::format("{}: {}", reader.file(), place));
}

}  // namespace

template <class Value>
std::vector<Value> Reader::attribute_values(const std::string& object, const char* name,
                                            int64_t count,
                                            std::vector<Value> (StoredArray::*read)() const) const {
  const std::string place = attribute_place(object, name);
  return named(*this, place, [&] {
    const StoredArray array = open_attribute(file_, *this, object, name, place);
    if (array.size() != count) refuse(place, "has {} values, expected {}", array.size(), count);
    return (array.*read)();
  });
}

int64_t Reader::rows(const std::string& path) const {
  return named(*this, path, [&] { return open_dataset(file_, *this, path).shape()[0]; });
}

StoredArray Reader::open_rows(const std::string& path, const Shape& shape, int64_t& rows) const {
  StoredArray array = open_dataset(file_, *this, path);
  require_shape(*this, path, array, shape);
  const base::Slab slab = base::slab(array.shape()[0], rank_, ranks_);
  rows = slab.rows();
  if (ranks_ > 1) array.select_rows(slab.begin, rows);
  return array;
}

std::vector<double> Reader::numbers(const std::string& path, const Shape& shape) const {
  return named(*this, path, [&] {
    int64_t rows = 0;
    std::vector<double> values = open_rows(path, shape, rows).numbers();
    const int64_t per_row = std::ssize(values) / std::max<int64_t>(rows, 1);
    require_finite(*this, path, values, std::max<int64_t>(per_row, 1));
    return values;
  });
}

std::vector<Vec3> Reader::vectors(const std::string& path, int64_t rows) const {
  const std::vector<double> flat = numbers(path, {rows, {3}});
  std::vector<Vec3> result(flat.size() / 3);
  for (size_t i = 0; i < result.size(); ++i) result[i] = Vec3::Map(flat.data() + 3 * i);
  return result;
}

std::vector<int64_t> Reader::whole_numbers(const std::string& path, const Shape& shape) const {
  return named(*this, path, [&] {
    int64_t rows = 0;
    return open_rows(path, shape, rows).whole_numbers();
  });
}

std::vector<std::string> Reader::names(const std::string& path) const {
  return named(*this, path, [&] {
    const StoredArray array = open_dataset(file_, *this, path);
    require_shape(*this, path, array, {Shape::any, {}});
    return array.strings();
  });
}

bool Reader::has_attribute(const std::string& object, const char* attribute) const {
  return named(*this, attribute_place(object, attribute), [&] {
    return check_hdf5(H5Aexists_by_name(file_, object.c_str(), attribute, H5P_DEFAULT)) > 0;
  });
}

double Reader::number(const std::string& object, const char* attribute) const {
  const double value = number_or_infinity(object, attribute);
  require_finite(*this, attribute_place(object, attribute), std::array{value}, 1);
  return value;
}

double Reader::number_or_infinity(const std::string& object, const char* attribute) const {
  const double value = attribute_values(object, attribute, 1, &StoredArray::numbers)[0];
  if (std::isnan(value)) refuse(attribute_place(object, attribute), "is not a number");
  return value;
}

int64_t Reader::integer(const std::string& object, const char* attribute) const {
  return attribute_values(object, attribute, 1, &StoredArray::whole_numbers)[0];
}

std::string Reader::text(const std::string& object, const char* attribute) const {
  return attribute_values(object, attribute, 1, &StoredArray::strings)[0];
}

Vec3 Reader::vector(const std::string& object, const char* attribute) const {
  const std::vector<double> values = attribute_values(object, attribute, 3, &StoredArray::numbers);
  require_finite(*this, attribute_place(object, attribute), values, 3);
  return Vec3::Map(values.data());
}

}  // namespace repose::results
