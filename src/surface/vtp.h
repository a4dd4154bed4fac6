#pragma once
#include <string>

#include "repose/surface/write.h"

namespace repose::surface {

/// A surface as VTK XML PolyData: arrays as base64 with 64-bit lengths, not compressed.
std::string vtp_bytes(const Surface& surface, const PointData& data);

}  // namespace repose::surface
