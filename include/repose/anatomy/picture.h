#pragma once
#include <string>

#include "repose/anatomy/propose.h"

namespace repose::anatomy {

/// A picture (SVG) by which a person confirms landmarks: the midsagittal section of skin and bones,
/// and skin and bones from in front, each landmark with its name. Sections and views are those of
/// the proposal's frame.
std::string draw_landmarks(const surface::Surface& skin, const surface::Surface& skull,
                           const surface::Surface& mandible, const Proposal& proposal);

}  // namespace repose::anatomy
