#pragma once
#include <map>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

/// Standard names of the landmarks of a head.
namespace repose::scene {

using Landmarks = std::map<std::string, Vec3>;  ///< standard name → position, mm, LPS

/// The position of a landmark, or null.
const Vec3* find(const Landmarks& landmarks, const char* name);

/// One landmark that has a standard name.
struct LandmarkName {
  std::string name;                  ///< as files of this project have it
  std::vector<std::string> aliases;  ///< other spellings that are understood, lower case
  bool on_skin;
};

/// All landmarks with a standard name, from above to below, bone first.
const std::vector<LandmarkName>& landmark_names();

/// The standard name that a spelling stands for ("ANS", "labrale superius", "Pog'"); empty where it
/// stands for none. Upper and lower case, blanks, hyphens and underscores are alike.
std::string standard_name(const std::string& spelling);

/// The standard name, missing among `landmarks`, that a name without one may misspell; else empty.
/// A name with another first letter is a point of the user's own (porion_left is not gonion_left).
std::string misspelled_name(const std::string& name, const Landmarks& landmarks);

/// Landmarks under their standard names; those without one keep theirs. InputError naming `file`
/// where two spellings of one landmark have different positions.
Landmarks with_standard_names(const Landmarks& landmarks, const std::string& file);

/// Returns the axes of a head as the rows left, back and up, by landmarks alone, so that they turn
/// with the head: left from the right condyle to the left one, and the level at which the
/// directions from the middle of the condyles to nasion and to the upper incisors rise by 14° in
/// sum. Without one of these two the level is that of the scan, without condyles (or with one
/// behind the other) all axes are.
Mat3 head_axes(const Landmarks& landmarks);

}  // namespace repose::scene
