#include "repose/base/hdf5.h"

#include <algorithm>
#include <string>

namespace repose::base {

namespace {

herr_t keep_innermost(unsigned depth, const H5E_error2_t* error, void* text) {
  if (depth == 0 && error->desc) *static_cast<std::string*>(text) = error->desc;
  return 0;
}

// HDF5 buries the system's words in a long list: "…, errno = 28, error message = 'No space …', …".
std::string single_line(std::string text) {
  const std::string mark = "error message = '";
  if (const auto start = text.find(mark); start != std::string::npos) {
    const auto begin = start + mark.size();
    return text.substr(begin, text.find('\'', begin) - begin);
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.empty() ? "unknown reason" : text;
}

void silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

Hdf5Properties file_access() {
  Hdf5Properties access(H5Pcreate(H5P_FILE_ACCESS));
  check_hdf5(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
  return access;
}

}  // namespace

void throw_hdf5_error() {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_innermost, &text);
  throw Hdf5Error(single_line(text));
}

bool is_hdf5(const std::filesystem::path& file) {
  silence();
  return H5Fis_hdf5(file.c_str()) > 0;
}

Hdf5File open_hdf5(const std::filesystem::path& file) {
  silence();
  return Hdf5File(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
}

Hdf5File create_hdf5(const std::filesystem::path& file) {
  silence();
  const Hdf5Properties creation(H5Pcreate(H5P_FILE_CREATE));
  check_hdf5(H5Pset_obj_track_times(creation, false));
  return Hdf5File(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, creation, file_access()));
}

Hdf5File open_hdf5(const std::filesystem::path& file, MPI_Comm comm) {
  silence();
  const Hdf5Properties access = file_access();
  check_hdf5(H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL));
  return Hdf5File(H5Fopen(file.c_str(), H5F_ACC_RDWR, access));
}

Hdf5Group create_hdf5_group(hid_t place, const char* name) {
  const Hdf5Properties creation(H5Pcreate(H5P_GROUP_CREATE));
  check_hdf5(H5Pset_obj_track_times(creation, false));
  return Hdf5Group(H5Gcreate2(place, name, H5P_DEFAULT, creation, H5P_DEFAULT));
}

bool hdf5_has(hid_t file, const std::string& path) {
  return check_hdf5(H5Lexists(file, path.c_str(), H5P_DEFAULT)) > 0;
}

}  // namespace repose::base
