#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

namespace repose::scene {

/// A named point, LPS, mm.
struct Landmark {
  std::string name;  ///< its number from 1 where the file has none
  Vec3 position;
};

/// Reads landmarks from 3D Slicer's Markups files, .mrk.json and .fcsv, from a plain CSV of rows
/// "name, x, y, z", or from our own JSON, {"name": [x, y, z], …} in LPS, of which entries of
/// another shape are left out. Points come as LPS whatever the file's frame, which the file must
/// say: "coordinateSystem" in .mrk.json, "# CoordinateSystem =" in .fcsv (0 or RAS, 1 or LPS), and
/// in a plain CSV a comment line "# CoordinateSystem = LPS" (or RAS). RAS differs by the signs of x
/// and y. Units are mm ("coordinateUnits" in .mrk.json, if there, must say so). Points that are not
/// placed ("positionStatus" other than "defined") are left out. Throws InputError, naming file and
/// place, for a frame that is not said or is neither, a coordinate that is not a finite number, and
/// a file that holds no point.
std::vector<Landmark> read_landmarks(const std::filesystem::path& file);
/// Reads landmarks by name. Throws InputError, too, for a name at two places more than 1e-3 mm
/// apart.
std::map<std::string, Vec3> landmarks_by_name(const std::filesystem::path& file);

/// The text of a .mrk.json file of these landmarks (LPS, mm), as 3D Slicer's Markups module reads
/// it.
std::string markups_text(const std::map<std::string, Vec3>& landmarks);

}  // namespace repose::scene
