#pragma once
#include <array>
#include <optional>
#include <vector>

#include "front_map.h"

namespace repose::anatomy {

/// The line between the lips as seen from in front.
struct LipCrease {
  std::vector<Vec3> points;  ///< in the frame, from the right corner to the left, every spacing
  bool open = false;         ///< the lips do not touch: the line runs through the middle of the gap
  double gap = 0;            ///< mm, the widest
  /// mm from the midline to where it ended, on the right and the left, where one of them cannot be
  /// a corner of the mouth; that end of the line is a guess.
  std::optional<std::array<double, 2>> lost{};
};

/// Returns how far, mm, the skin at a place lies behind the mean of that 4 mm above and below it;
/// nothing where one of the three has no skin.
std::optional<double> crease_depth(const FrontMap& skin, double x, double z);

/// The height of the middle of the gap between open lips, within 12 mm of z; nothing where there is
/// none wider than 1.5 mm.
std::optional<double> open_mouth(const FrontMap& skin, double z);

/// Follows the crease from the midline to both sides, beginning at height `z`, to the corners
/// `right` and `left` where these are given, else until it is shallower than a quarter of its depth
/// in the middle over 2.5 mm. If neither is given, a side on which it ends at less than 0.7 of the
/// other's distance from the midline, or 15 mm, is continued to that distance in parallel with the
/// other; one on which it runs on beyond 34 mm ends at the other's, or at 25 mm.
LipCrease follow_crease(const FrontMap& skin, double z, const std::optional<Vec3>& right,
                        const std::optional<Vec3>& left);

}  // namespace repose::anatomy
