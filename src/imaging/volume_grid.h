#pragma once
#include "itk/image.h"
#include "repose/imaging/volume.h"

/// From an image as ITK reads it to a volume.
namespace repose::imaging {

/// The axes of an image, in mm; refuses a spacing that is not a positive number.
Mat3 axes_of(const Image& image, const std::string& name);

/// The one series of DICOM slices in a folder, sorted along their normal; files of other kinds are
/// passed over. Throws InputError for no or several series, and for slices that do not belong
/// together, are doubled or missing.
Volume read_dicom(const std::filesystem::path& folder, const Watch& watch);

}  // namespace repose::imaging
