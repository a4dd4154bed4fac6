#pragma once
#include <vector>

#include "repose/scene/rigid_motion.h"

/// Moves that put anatomical points in their places.
namespace repose::scene {

/// The motion that takes landmarks `from` to `to` (mm, equally many, at least one): one, the
/// translation; two, middle to middle and the least turn that lines them up; more, the best rigid
/// motion (fit_rigid_motion). Its residual is the largest distance of a landmark from its place.
/// Throws InputError where they do not fix a turn.
RigidFit fit_landmarks(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

}  // namespace repose::scene
