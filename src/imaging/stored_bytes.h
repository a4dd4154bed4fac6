#pragma once
#include <cstdint>
#include <filesystem>

#include "itk/image.h"

namespace repose::imaging {

/// The number of bytes in a file; 0 where it is missing.
int64_t file_bytes(const std::filesystem::path& file);

/// Returns the number of bytes in a zlib or gzip stream, or several in a row, from `offset` on; of
/// a damaged one those before the damage.
int64_t unpacked_bytes(const std::filesystem::path& file, int64_t offset);

/// Throws InputError where a file of MetaImage, NIfTI or DICOM is too short to hold the voxels of
/// its header: their libraries fill up with zeros or leave what they find (NRRD's does not).
/// Compressed files are unpacked to their end, without keeping it. Files it cannot judge pass.
void check_stored_bytes(const std::filesystem::path& file, ImageFormat format, const Image& header);

/// Throws InputError where an element of a DICOM file in little endian says it holds more than the
/// file: its library allocates that memory at once. Elements up to the pixels are looked
/// at; a file without DICOM's mark passes.
void check_dicom_lengths(const std::filesystem::path& file);

/// Throws InputError where a NIfTI file's header holds a spacing of 0, which its library takes for
/// 1, or none that is finite, or an orientation that is huge or not finite, which ITK factorizes
/// for ever. A file that is no NIfTI passes.
void check_nifti_header(const std::filesystem::path& file);

/// Throws InputError for a NRRD file in the space left-anterior-superior, of which ITK 5 changes
/// the sign of x in place of that of y.
void check_nrrd_space(const std::filesystem::path& file);

}  // namespace repose::imaging
