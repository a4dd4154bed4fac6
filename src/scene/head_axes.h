#pragma once
#include <string>

#include "repose/scene/landmark_names.h"

namespace repose::scene {

/// The directions of a head in the scan: left from the right condyle to the left one, up and back
/// by the scan's pitch. Unit vectors.
struct HeadAxes {
  Vec3 left, back, up;
};

/// Throws InputError naming the landmark and `file` where a condyle is missing.
HeadAxes head_axes(const Landmarks& landmarks, const std::string& file);

/// The position of a landmark. Throws InputError naming it, and `file`, where it is missing.
Vec3 require_landmark(const Landmarks& landmarks, const std::string& name, const std::string& file);

}  // namespace repose::scene
