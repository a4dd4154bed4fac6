#pragma once
#include <filesystem>

#include "repose/base/geometry.h"

namespace repose::scene {

/// The matrix of ITK's transform in an HDF5 file, from planned to present place: a linear one, or a
/// composite of linear ones, of which the last is applied first. Throws InputError naming the file.
Mat4 read_hdf5_transform(const std::filesystem::path& file);

}  // namespace repose::scene
