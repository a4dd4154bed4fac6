#pragma once
#include <filesystem>

#include "itk/image.h"

/// MetaImage headers and the files that hold their voxels.
namespace repose::imaging {

/// Throws InputError where a header has more dimensions than its library counts to in a lifetime or
/// a size that is not positive, and where the name of its data file is a format other than of one
/// number.
void check_meta_header(const std::filesystem::path& file);

/// Throws InputError where the files that a header names are fewer or more than its slices, missing
/// or too short; the library leaves the voxels of such slices as zeros.
void check_meta_voxels(const std::filesystem::path& file, const Image& header);

}  // namespace repose::imaging
