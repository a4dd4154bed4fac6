#pragma once
#include "repose/imaging/volume.h"
#include "repose/surface/surface.h"

namespace repose::imaging {

using surface::Surface;

/// Smoothing that does not shrink: `rounds` pairs of steps of the umbrella operator with λ = 0.5
/// and μ = −1 / (1/λ − 0.1), a low-pass filter with pass-band frequency 0.1 (Taubin, "A Signal
/// Processing Approach to Fair Surface Design", SIGGRAPH 1995). Points on a border stay. Returns
/// the largest way that a point went, mm. O(rounds · T).
double smooth_taubin(Surface& surface, int64_t rounds, const Watch& watch = {});

}  // namespace repose::imaging
