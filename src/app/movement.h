#pragma once
#include <string>
#include <vector>

#include "repose/model/build.h"
#include "repose/solve/repose.h"

namespace repose::app {

/// Returns one sentence on how the face moved: each place's components along `axes` (rows left,
/// back and up, unit vectors), the largest movement and where it is. `initial`: the skin;
/// `moved` [points] of it, mm.
std::string describe_movement(const std::vector<model::FacePlace>& places, const Mat3& axes,
                              const surface::Surface& initial, const std::vector<Vec3>& moved);

/// Returns how far parted lips are apart along `up`, a unit vector, in the middle of the mouth, in
/// one sentence with a blank after it. Empty without the landmark stomion, and where the skin is
/// not parted within 8 mm of it. `initial`: the skin; `moved` [points] of it, mm.
std::string describe_lips(const scene::Landmarks& landmarks, const Vec3& up,
                          const surface::Surface& initial, const std::vector<Vec3>& moved);

/// Returns how far the face is from rest and, where that was estimated (`discretization`, mm; else
/// negative), from the continuum.
std::string describe_trust(const solve::Summary& summary, double discretization);

}  // namespace repose::app
