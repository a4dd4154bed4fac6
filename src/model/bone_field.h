#pragma once
#include <optional>
#include <vector>

#include "repose/surface/distance.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// All bones at their initial position, queried together. Rows of `bones` are those of the scene.
class BoneField {
 public:
  /// One tree a bone, O(T log T).
  explicit BoneField(const std::vector<surface::Surface>& bones);

  struct Nearest {
    Vec3 point = Vec3::Zero();  ///< mm
    double distance;            ///< mm, infinite where there are no bones
    int32_t bone = -1;
  };
  /// Closest point of any bone (the first bone wins a tie).
  Nearest nearest(const Vec3& query) const;

  /// Returns how far along the unit vector `direction` a ray from `origin` meets the first bone,
  /// mm, at most `reach`.
  std::optional<double> first_hit(const Vec3& origin, const Vec3& direction, double reach) const;

  double distance(int32_t bone, const Vec3& query) const {
    return trees_[bone].nearest(query).distance;
  }
  /// The bone that `query` lies inside of, −1 for none.
  int32_t containing(const Vec3& query) const;
  int32_t size() const { return static_cast<int32_t>(trees_.size()); }

 private:
  std::vector<surface::DistanceTree> trees_;
};

}  // namespace repose::model
