#include "repose/base/hdf5_values.h"

namespace repose::base {

bool hdf5_has(hid_t file, const std::string& path) {
  return check_hdf5(H5Lexists(file, path.c_str(), H5P_DEFAULT)) > 0;
}

std::vector<double> read_hdf5_numbers(hid_t file, const std::string& path) {
  const Hdf5Dataset dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT));
  const Hdf5Space space(H5Dget_space(dataset));
  const Hdf5Type type(H5Dget_type(dataset));
  const H5T_class_t kind = H5Tget_class(type);
  if (kind != H5T_FLOAT && kind != H5T_INTEGER) throw Hdf5Error(path + " holds no numbers");
  constexpr hssize_t most = 1 << 20;
  const hssize_t count = check_hdf5(H5Sget_simple_extent_npoints(space));
  if (count > most) throw Hdf5Error(path + " holds too many numbers");
  std::vector<double> values(count);
  check_hdf5(H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  return values;
}

std::string read_hdf5_text(hid_t file, const std::string& path) {
  const Hdf5Dataset dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT));
  const Hdf5Space space(H5Dget_space(dataset));
  const Hdf5Type type(H5Dget_type(dataset));
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1)
    throw Hdf5Error(path + " holds no single text");
  if (check_hdf5(H5Tis_variable_str(type)) == 0) {
    std::string text(H5Tget_size(type), '\0');
    check_hdf5(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
    return text.c_str();
  }
  const Hdf5Type memory(H5Tcopy(type));
  char* text = nullptr;
  check_hdf5(H5Dread(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, &text));
  std::string copy = text ? text : "";
  check_hdf5(H5Dvlen_reclaim(memory, space, H5P_DEFAULT, &text));
  return copy;
}

}  // namespace repose::base
