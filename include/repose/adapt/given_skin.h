#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "repose/surface/write.h"

namespace repose::adapt {

/// Maps the points of the solved skin to the vertices of the given one.
struct GivenSkinMap {
  using Sum = std::vector<std::pair<int64_t, double>>;
  std::vector<Sum> sum;        ///< [vertices] their displacement: rows of solved points, weights
  std::vector<double> solved;  ///< [vertices] share of it that is left, 1 over the solved skin
};

/// The map that displacement_of_given() applies. Serial.
GivenSkinMap map_to_given(const surface::Surface& given, const surface::Surface& skin);

/// The displacement of the solved skin carried to the vertices of a given one, which may be dense,
/// dirty and larger: an affine motion fitted to the 16 nearest skin points of the model around the
/// nearest triangle, all of one side of a cut, by moving least squares; for what lies farther off
/// than they do (ears, inner walls) that at their border.
/// Beyond the rim of the solved skin it fades to nothing over 20 mm. The fields are `displacement`
/// (mm) and `solved`, the share of it that is left (1 over the solved skin). `displacement` is that
/// of the points of the solved `skin`. Serial.
surface::PointData displacement_of_given(const surface::Surface& given,
                                         const surface::Surface& skin,
                                         const std::vector<Vec3>& displacement);

}  // namespace repose::adapt
