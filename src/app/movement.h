#pragma once
#include <string>
#include <vector>

#include "repose/model/build.h"
#include "repose/solve/repose.h"

namespace repose::app {

/// Row of the point nearest to a place; 0 without points.
size_t nearest_point(const Vec3& place, const std::vector<Vec3>& points);

/// Returns one sentence on how the face moved: each place's components along `axes` (rows left,
/// back and up, unit vectors), the largest movement and where it is. `initial` and `moved` [points]
/// of the skin, mm.
std::string describe_movement(const std::vector<model::FacePlace>& places, const Mat3& axes,
                              const std::vector<Vec3>& initial, const std::vector<Vec3>& moved);

/// Returns how far the face is from rest and, where that was estimated (`discretization`, mm; else
/// negative), from the continuum.
std::string describe_trust(const solve::Summary& summary, double discretization);

}  // namespace repose::app
