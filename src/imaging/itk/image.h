#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

/// Images as ITK reads them. ITK brings an Eigen of its own, so nothing of Eigen is in here, and
/// image.cpp, the one file that includes ITK, includes nothing of ours that has it.
namespace repose::imaging {

enum class ImageFormat { nifti, nrrd, meta, dicom };

struct Image {
  std::vector<int64_t> size;                         ///< along each axis, of any number
  int64_t numbers = 1;                               ///< per voxel
  std::array<double, 3> spacing{}, origin{};         ///< mm, LPS
  std::array<std::array<double, 3>, 3> direction{};  ///< [a] unit vector of axis a, LPS
  int64_t bytes = 0;                                 ///< of its voxels when not packed
  std::string series, title;                         ///< DICOM: series' UID and description
  std::vector<float> values;                         ///< first axis fastest
};

/// Returns whether the file is DICOM. Throws InputError for one that begins so and is damaged.
bool is_dicom(const std::filesystem::path& file);

/// Reads the header alone; `values` stay empty. An axis that the file lacks has the spacing 1.
/// Throws InputError naming the file where ITK cannot read it.
Image read_header(const std::filesystem::path& file, ImageFormat format);

/// Reads the whole image. Throws InputError, also where the memory for it is lacking.
Image read_image(const std::filesystem::path& file, ImageFormat format);

}  // namespace repose::imaging
