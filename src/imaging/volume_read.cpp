#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "meta_image.h"
#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "stored_bytes.h"
#include "volume_grid.h"

namespace repose::imaging {
namespace {

ImageFormat format_of(const std::filesystem::path& file) {
  const std::string name = base::lower(file.filename().string());
  const auto ends = [&](const char* ending) { return name.ends_with(ending); };
  if (ends(".nii") || ends(".nii.gz")) return ImageFormat::nifti;
  if (ends(".nrrd") || ends(".nhdr")) return ImageFormat::nrrd;
  if (ends(".mha") || ends(".mhd")) return ImageFormat::meta;
  base::refuse(
      "{}: not a volume this program reads; name a folder of DICOM slices or a file .nii, .nii.gz, "
      ".nrrd, .nhdr, .mha or .mhd",
      file.string());
}

void check_header(const Image& image, const std::string& name) {
  if (image.size.size() < 3)
    base::refuse("{}: has {} dimensions; a volume has 3", name, image.size.size());
  for (size_t axis = 3; axis < image.size.size(); ++axis)
    if (image.size[axis] != 1)
      base::refuse("{}: holds {} volumes; export one of them", name, image.size[axis]);
  if (image.numbers != 1)
    base::refuse("{}: has {} numbers a voxel (colors?); a CT or a label map has one", name,
                 image.numbers);
}

Volume read_file(const std::filesystem::path& file) {
  const ImageFormat format = format_of(file);
  const std::string name = file.string();
  if (format == ImageFormat::nifti) check_nifti_header(file);
  if (format == ImageFormat::nrrd) check_nrrd_space(file);
  if (format == ImageFormat::meta) check_meta_header(file);
  const Image image = read_header(file, format);
  check_header(image, name);
  Volume volume{name,
                {image.size[0], image.size[1], image.size[2]},
                axes_of(image, name),
                Vec3::Map(image.origin.data()),
                {},
                {}};
  check_stored_bytes(file, format, image);
  volume.values = read_image(file, format).values;
  return volume;
}

void check_grid(const Volume& volume) {
  for (int axis = 0; axis < 3; ++axis)
    if (volume.size[axis] < 2)
      base::refuse("{}: has {} voxel along axis {}; a volume needs at least 2 along each",
                   volume.name, volume.size[axis], "ijk"[axis]);
  const double product = volume.spacing(0) * volume.spacing(1) * volume.spacing(2);
  if (!volume.origin.allFinite() || !(std::abs(volume.axes.determinant()) > 1e-3 * product))
    base::refuse("{}: its axes span no volume; mend its direction matrix", volume.name);
}

void replace_not_finite(Volume& volume) {
  float minimum = std::numeric_limits<float>::infinity();
  for (const float value : volume.values)
    if (std::isfinite(value)) minimum = std::min(minimum, value);
  const auto infinite = [](float value) { return !std::isfinite(value); };
  const auto count = std::count_if(volume.values.begin(), volume.values.end(), infinite);
  if (count == 0) return;
  if (std::isinf(minimum)) base::refuse("{}: holds no finite number; export it again", volume.name);
  std::replace_if(volume.values.begin(), volume.values.end(), infinite, minimum);
  volume.remarks.push_back(
      fmt::format("{} values that are not finite taken as {:g}, the least", count, minimum));
}

}  // namespace

Mat3 axes_of(const Image& image, const std::string& name) {
  Mat3 axes;
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = image.spacing[axis];
    if (!std::isfinite(spacing) || !(spacing > 0))
      base::refuse("{}: its spacing along axis {} is {:g} mm; it must be > 0: mend the header",
                   name, "ijk"[axis], spacing);
    for (int row = 0; row < 3; ++row) axes(row, axis) = image.direction[axis][row] * spacing;
  }
  return axes;
}

Mat3 inverse_axes(const Volume& volume) { return volume.axes.inverse(); }

Volume read_volume(const std::filesystem::path& path, const Watch& watch) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    base::refuse("{}: no such file or folder; check the path of this volume", path.string());
  base::record_input(path);
  Volume volume = std::filesystem::is_directory(path) ? read_dicom(path, watch) : read_file(path);
  check_grid(volume);
  replace_not_finite(volume);
  return volume;
}

}  // namespace repose::imaging
