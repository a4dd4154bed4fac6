#pragma once
#include <optional>
#include <vector>

#include "repose/anatomy/head_frame.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

/// A point of a profile in a sagittal plane of a head frame, mm: y backwards, z up.
using ProfilePoint = Eigen::Vector2d;

/// Depth of a surface as seen from in front: for each cell of a grid in the frontal plane of a head
/// frame the foremost y, mm. Inner walls of a raw surface do not matter, and holes at most 12 mm
/// wide are closed, so that nothing is seen through them.
class FrontMap {
 public:
  /// Covers all of the surface.
  FrontMap(const surface::Surface& surface, const HeadFrame& frame);

  /// The foremost y at a place of the frontal plane; nothing where no surface is behind it.
  std::optional<double> depth(double x, double z) const;
  /// The foremost y over the cells within `half_width` of x; nothing where there is none.
  std::optional<double> foremost(double x, double z, double half_width) const;

  double low_z() const { return low_.y(); }
  double high_z() const { return low_.y() + spacing_ * static_cast<double>(rows_); }
  double spacing() const { return spacing_; }  ///< mm, of the cells
  /// Returns coordinates a cell apart, upwards (sign 1) or downwards (−1), up to `to`, which
  /// rounding does not leave out.
  std::vector<double> steps(double from, double to, int sign = 1) const;

  /// The foremost points within `half_width` of x = `aside`, the midline by default, between two
  /// heights, from below, at the middles of cells.
  std::vector<ProfilePoint> profile(double from_z, double to_z, double half_width,
                                    double aside = 0) const;

 private:
  void draw(const std::array<Vec3, 3>& corner);
  double& cell(int64_t column, int64_t row) { return depth_[row * columns_ + column]; }

  static constexpr double spacing_ = 0.5;
  Eigen::Vector2d low_;  // x, z of the lowest corner, mm
  int64_t columns_ = 0, rows_ = 0;
  std::vector<double> depth_;  // ∞ where there is nothing
};

/// Returns the points of a profile between two heights.
std::vector<ProfilePoint> between(const std::vector<ProfilePoint>& profile, double from_z,
                                  double to_z);
/// The point of a profile, which has points, at the height `z`, or at its end nearest to that.
ProfilePoint at_height(const std::vector<ProfilePoint>& profile, double z);
/// The point of a profile that lies farthest in front of the line through `a` and `b` (behind it
/// with sign −1), of a flat stretch its middle: the mean of heights, weighted with what the
/// distance is above the largest less `flat` mm. Nothing where the profile has no point.
std::optional<ProfilePoint> farthest_from_chord(const std::vector<ProfilePoint>& profile,
                                                const ProfilePoint& a, const ProfilePoint& b,
                                                int sign, double flat = 0.5);
/// The foremost point of a profile; of a flat stretch its middle, as above.
std::optional<ProfilePoint> foremost_of(const std::vector<ProfilePoint>& profile);
/// The chin: the foremost point of a profile between two heights. Within 3 mm of the upper one,
/// where the profile still comes forward, the line in front of which points are compared leans
/// toward the chord between the ends, the more the nearer.
std::optional<ProfilePoint> chin_of(const std::vector<ProfilePoint>& profile, double from_z,
                                    double to_z);
/// Point B: the deepest of a profile behind the chord from pogonion to the lower incisors' edge.
/// Less than 1 mm behind it, the nearer to the `usual` height the less, which decides where the
/// profile is not concave. Nothing where the profile has no point.
std::optional<ProfilePoint> b_point_of(const std::vector<ProfilePoint>& profile,
                                       const ProfilePoint& pogonion, const ProfilePoint& edge,
                                       double usual);

}  // namespace repose::anatomy
