#pragma once
#include <string>
#include <vector>

#include "repose/base/hdf5.h"

/// Small datasets of foreign HDF5 files, read serially. Throws Hdf5Error.
namespace repose::base {

/// Whether there is something at a path whose parent exists.
bool hdf5_has(hid_t file, const std::string& path);

/// All numbers of a dataset, as doubles.
std::vector<double> read_hdf5_numbers(hid_t file, const std::string& path);

/// The first string of a dataset, of fixed or variable length.
std::string read_hdf5_text(hid_t file, const std::string& path);

}  // namespace repose::base
