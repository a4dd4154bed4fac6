#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "repose/scene/rigid_motion.h"

/// Anatomical points by name, and moves that put them in their places.
namespace repose::scene {

/// Landmarks in mm, LPS: JSON with {"name": [x, y, z], …}, of which entries of another shape are
/// left out, or 3D Slicer's markups (.mrk.json; RAS is turned to LPS). Throws InputError naming the
/// file where it cannot be read or holds none.
std::map<std::string, Vec3> read_landmarks(const std::filesystem::path& file);

/// The motion that takes landmarks `from` to `to` (mm, equally many, at least one): one, the
/// translation; two, middle to middle and the least turn that lines them up; more, the best rigid
/// motion (fit_rigid_motion). Its residual is the largest distance of a landmark from its place.
/// Throws InputError where they do not fix a turn.
RigidFit fit_landmarks(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

}  // namespace repose::scene
