#pragma once
#include <string>

#include "repose/scene/landmark_names.h"
#include "repose/scene/scene.h"

namespace repose::scene {

/// The directions of a head in the scan, unit vectors.
struct HeadAxes {
  Vec3 left, back, up;
};

/// The axes of a plan. Throws InputError naming the landmark and the file where a condyle is
/// missing.
HeadAxes require_axes(const AnatomyPlan& plan);

/// The position of a landmark. Throws InputError naming it, and `file`, where it is missing.
Vec3 require_landmark(const Landmarks& landmarks, const std::string& name, const std::string& file);

}  // namespace repose::scene
