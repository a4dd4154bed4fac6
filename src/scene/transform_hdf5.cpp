#include "transform_hdf5.h"

#include "repose/base/error.h"
#include "repose/base/hdf5.h"
#include "stored_transform.h"

namespace repose::scene {
namespace {

base::StoredArray open_array(hid_t file, const std::string& path, const std::string& place) {
  constexpr int64_t maximum = 1 << 20;
  base::StoredArray array(base::Hdf5Dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT)), place);
  if (array.size() > maximum) throw base::Hdf5Error(path + " holds too much");
  return array;
}

std::string read_kind(hid_t file, const std::string& group, const std::string& place) {
  const std::string path = group + "/TransformType";
  const std::vector<std::string> kind = open_array(file, path, place).strings();
  if (kind.size() != 1) throw base::Hdf5Error(path + " holds no single text");
  return kind[0];
}

/// ITK once misspelled its own names, and still reads both.
Line read_numbers(hid_t file, const std::string& group, const std::string& place, const char* name,
                  const char* misspelled) {
  for (const char* spelling : {name, misspelled}) {
    const std::string path = group + "/" + spelling;
    if (base::hdf5_has(file, path)) return {place, "", open_array(file, path, place).numbers()};
  }
  base::refuse("{}: holds no {}; save the transform again", place, name);
}

Stored read_group(hid_t file, const std::string& group, const std::string& name) {
  const std::string place = name + ":" + group;
  Stored stored;
  stored.kind = Line{place, read_kind(file, group, place), {}};
  check_kind(*stored.kind);
  stored.parameters = read_numbers(file, group, place, "TransformParameters", "TranformParameters");
  stored.fixed =
      read_numbers(file, group, place, "TransformFixedParameters", "TranformFixedParameters");
  return stored;
}

std::string group_of(int number) { return fmt::format("/TransformGroup/{}", number); }

Mat4 read_open(hid_t file, const std::string& name) {
  if (!base::hdf5_has(file, "/TransformGroup") || !base::hdf5_has(file, group_of(0)))
    base::refuse("{}: holds no ITK transform (no /TransformGroup/0); save it as .h5 or .tfm", name);
  const std::string kind = read_kind(file, group_of(0), name);
  const bool composite = kind.starts_with("CompositeTransform_");
  if (!composite && base::hdf5_has(file, group_of(1)))
    base::refuse("{}: the file holds more than one transform; save one alone", name);
  if (!composite) return matrix_of(read_group(file, group_of(0), name));
  Mat4 whole = Mat4::Identity();
  int part = 1;
  for (; base::hdf5_has(file, group_of(part)); ++part)
    whole = whole * matrix_of(read_group(file, group_of(part), name));
  if (part == 1) base::refuse("{}: a composite transform without parts; save it again", name);
  return whole;
}

}  // namespace

Mat4 read_hdf5_transform(const std::filesystem::path& file) {
  const std::string name = file.string();
  try {
    return read_open(base::open_hdf5(file), name);
  } catch (const base::Hdf5Error& error) {
    base::refuse("{}: cannot be read as an ITK transform in HDF5: {}", name, error.what());
  }
}

}  // namespace repose::scene
