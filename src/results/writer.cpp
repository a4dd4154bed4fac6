#include "writer.h"

#include <algorithm>
#include <exception>
#include <limits>

namespace repose::results {

using base::check_hdf5;

namespace {

base::Hdf5Space make_space(const std::vector<hsize_t>& shape) {
  return base::Hdf5Space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr));
}

base::Hdf5Dataset create_dataset(hid_t place, const std::string& name, hid_t type, hid_t space) {
  const base::Hdf5Properties creation(H5Pcreate(H5P_DATASET_CREATE));
  check_hdf5(H5Pset_layout(creation, H5D_CONTIGUOUS));
  check_hdf5(H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER));
  check_hdf5(H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY));
  check_hdf5(H5Pset_obj_track_times(creation, false));
  return base::Hdf5Dataset(
      H5Dcreate2(place, name.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT));
}

base::Hdf5Type fixed_string(size_t length) {
  base::Hdf5Type type(H5Tcopy(H5T_C_S1));
  check_hdf5(H5Tset_size(type, std::max<size_t>(length, 1)));
  check_hdf5(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return type;
}

}  // namespace

void write_array(hid_t place, const std::string& name, const std::vector<hsize_t>& shape,
                 std::pair<hid_t, hid_t> type, const void* values) {
  const base::Hdf5Space space = make_space(shape);
  const base::Hdf5Dataset dataset = create_dataset(place, name, type.first, space);
  if (values && check_hdf5(H5Sget_simple_extent_npoints(space)) > 0)
    check_hdf5(H5Dwrite(dataset, type.second, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
}

void write_strings(hid_t place, const std::string& name, const std::vector<std::string>& values) {
  size_t width = 1;
  for (const std::string& value : values) width = std::max(width, value.size());
  std::string bytes;
  for (const std::string& value : values) bytes += value + std::string(width - value.size(), '\0');
  const base::Hdf5Type type = fixed_string(width);
  write_array(place, name, {values.size()}, {type, type}, bytes.data());
}

void write_attribute(hid_t object, const char* name, std::pair<hid_t, hid_t> type,
                     const base::Hdf5Space& space, const void* values) {
  const base::Hdf5Attribute attribute(
      H5Acreate2(object, name, type.first, space, H5P_DEFAULT, H5P_DEFAULT));
  check_hdf5(H5Awrite(attribute, type.second, values));
}

void write_attribute(hid_t object, const char* name, const std::string& value) {
  const base::Hdf5Type type = fixed_string(value.size());
  write_attribute(object, name, {type, type}, base::Hdf5Space(H5Screate(H5S_SCALAR)),
                  value.c_str());
}

namespace {

/// Sets the fill value for rows of a virtual dataset that no piece covers.
void set_fill(hid_t creation, hid_t type) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  const int64_t none = -1;
  const bool whole = H5Tget_class(type) == H5T_INTEGER;
  check_hdf5(H5Pset_fill_value(creation, whole ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE,
                               whole ? static_cast<const void*>(&none) : &nothing));
}

}  // namespace

void write_virtual(hid_t place, const std::string& name, const std::vector<VirtualPiece>& pieces,
                   const std::vector<hsize_t>& shape) {
  const base::Hdf5Space whole = make_space(shape);
  const base::Hdf5Properties creation(H5Pcreate(H5P_DATASET_CREATE));
  check_hdf5(H5Pset_obj_track_times(creation, false));
  base::Hdf5Type type;
  const hsize_t columns = shape.size() > 1 ? shape[1] : 1;
  for (const VirtualPiece& piece : pieces) {
    const base::Hdf5Dataset source(H5Dopen2(place, piece.path.c_str(), H5P_DEFAULT));
    const base::Hdf5Space of_source(H5Dget_space(source));
    type = base::Hdf5Type(H5Dget_type(source));
    const auto numbers = static_cast<hsize_t>(H5Sget_simple_extent_npoints(of_source));
    const hsize_t start[2] = {piece.first, 0}, count[2] = {numbers / columns, columns};
    check_hdf5(H5Sselect_hyperslab(whole, H5S_SELECT_SET, start, nullptr, count, nullptr));
    check_hdf5(H5Pset_virtual(creation, whole, ".", piece.path.c_str(), of_source));
  }
  set_fill(creation, type);
  base::Hdf5Dataset(
      H5Dcreate2(place, name.c_str(), type, whole, H5P_DEFAULT, creation, H5P_DEFAULT));
}

namespace {

constexpr int64_t piece_bytes = int64_t{1} << 28;

/// Writes some rows, possibly none; every rank calls it.
void write_piece(hid_t dataset, const base::Slab& rows, const void* values, hid_t memory_type) {
  const base::Hdf5Space space(H5Dget_space(dataset));
  hsize_t count[2] = {0, 0};
  const int dimensions = check_hdf5(H5Sget_simple_extent_dims(space, count, nullptr));
  const hsize_t start[2] = {static_cast<hsize_t>(rows.begin), 0};
  count[0] = static_cast<hsize_t>(rows.rows());
  const base::Hdf5Space memory(H5Screate_simple(dimensions, count, nullptr));
  if (rows.rows() == 0) {
    check_hdf5(H5Sselect_none(space));
    check_hdf5(H5Sselect_none(memory));
  } else {
    check_hdf5(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr));
  }
  const base::Hdf5Properties transfer(H5Pcreate(H5P_DATASET_XFER));
  check_hdf5(H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE));
  // Slabs are contiguous: nothing to gather, and MPI-IO's own collective writes hang on a disk
  // error.
  check_hdf5(H5Pset_dxpl_mpio_collective_opt(transfer, H5FD_MPIO_INDIVIDUAL_IO));
  check_hdf5(H5Dwrite(dataset, memory_type, memory, space, transfer, values));
}

}  // namespace

base::Hdf5Dataset create_rows(hid_t place, const std::string& name, int64_t rows, int64_t columns) {
  std::vector<hsize_t> shape = {static_cast<hsize_t>(rows)};
  if (columns > 0) shape.push_back(columns);
  return create_dataset(place, name, H5T_IEEE_F64LE, make_space(shape));
}

void write_rows(MPI_Comm comm, const base::Hdf5Dataset& dataset, const base::Slab& mine,
                const void* values, hid_t memory_type) {
  const base::Hdf5Space space(H5Dget_space(dataset));
  if (check_hdf5(H5Sget_simple_extent_npoints(space)) == 0) return;
  hsize_t shape[2] = {0, 0};
  check_hdf5(H5Sget_simple_extent_dims(space, shape, nullptr));
  const auto row_bytes =
      static_cast<int64_t>(H5Tget_size(memory_type) * std::max<hsize_t>(shape[1], 1));
  const int64_t step = std::max<int64_t>(piece_bytes / row_bytes, 1);
  const int64_t longest = base::max_over_ranks(comm, mine.rows());
  static const double nothing = 0;
  std::exception_ptr failure;
  for (int64_t done = 0; done < longest; done += step) try {
      const base::Slab piece{std::min(mine.begin + done, mine.end),
                             std::min(mine.begin + done + step, mine.end)};
      write_piece(dataset, piece,
                  values ? static_cast<const char*>(values) + (piece.begin - mine.begin) * row_bytes
                         : static_cast<const void*>(&nothing),
                  memory_type);
    } catch (const base::Hdf5Error&) {
      failure = std::current_exception();
    }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace repose::results
