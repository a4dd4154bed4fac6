#pragma once
#include <map>
#include <string>
#include <vector>

#include "repose/anatomy/head_frame.h"
#include "repose/scene/landmark_names.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

using scene::Landmarks;

/// Landmarks found on the surfaces of a head.
struct Proposal {
  HeadFrame frame;                             ///< with the facial line nasion–pogonion upright
  Landmarks found;                             ///< by standard name, mm, in the scan
  std::map<std::string, std::string> missing;  ///< standard name → why it was not found
  std::vector<std::string> remarks;            ///< about the head, each a line
};

/// Finds landmarks from the shape of skin, skull and mandible (LPS, mm; the skin may be an open
/// patch or raw): extremal points of the midsagittal profiles in a frame made by the skull's
/// symmetry plane and the facial line, edges of the teeth, tops of the condyles, the crease between
/// the lips. Points that coincide are merged, and specks left out. Landmarks in `given` are kept
/// and guide the search of the others. Throws InputError where the surfaces are not those of one
/// head in LPS.
Proposal propose_landmarks(const surface::Surface& skin, const surface::Surface& skull,
                           const surface::Surface& mandible, const Landmarks& given);

/// The crease between the lips on a skin, from the right corner of the mouth to the left one, mm,
/// every 2 mm; empty where there is none near `stomion`. Ends where the crease is shallower than a
/// quarter of its depth in the middle, or at the given corners.
std::vector<Vec3> find_lip_crease(const surface::Surface& skin, const HeadFrame& frame,
                                  const Landmarks& landmarks);

}  // namespace repose::anatomy
