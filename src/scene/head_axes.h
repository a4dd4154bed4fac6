#pragma once
#include <string>

#include "repose/scene/scene.h"

namespace repose::scene {

/// The directions of a head in the scan, unit vectors.
struct HeadAxes {
  Vec3 left, back, up;
};

/// Returns the axes of a head as the rows left, back and up, by landmarks alone, so that they turn
/// with the head: left from the right condyle to the left one, and the level at which the
/// directions from the middle of the condyles to nasion and to the upper incisors rise by 14°
/// together. Without one of these two the level is that of the scan, without condyles all axes are.
Mat3 head_axes(const Landmarks& landmarks);

/// The axes of a plan. Throws InputError naming the landmark and the file where a condyle is
/// missing.
HeadAxes require_axes(const AnatomyPlan& plan);

/// The position of a landmark. Throws InputError naming it, and `file`, where it is missing.
Vec3 require_landmark(const Landmarks& landmarks, const std::string& name, const std::string& file);

}  // namespace repose::scene
