#include "bone_field.h"

#include <limits>

namespace repose::model {

BoneField::BoneField(const std::vector<surface::Surface>& bones) {
  trees_.reserve(bones.size());
  for (const surface::Surface& bone : bones) trees_.emplace_back(bone);
}

BoneField::Nearest BoneField::nearest(const Vec3& query) const {
  Nearest best{.distance = std::numeric_limits<double>::infinity()};
  for (int32_t b = 0; b < size(); ++b) {
    const auto found = trees_[b].nearest(query);
    if (found.distance < best.distance) best = {found.point, found.distance, b};
  }
  return best;
}

std::optional<double> BoneField::first_hit(const Vec3& origin, const Vec3& direction,
                                           double reach) const {
  std::optional<double> nearest;
  for (const surface::DistanceTree& tree : trees_)
    if (const auto hit = tree.first_hit(origin, direction, nearest.value_or(reach)))
      nearest = std::min(hit->distance, nearest.value_or(hit->distance));
  return nearest;
}

int32_t BoneField::containing(const Vec3& query) const {
  for (int32_t b = 0; b < size(); ++b)
    if (trees_[b].contains(query)) return b;
  return -1;
}

}  // namespace repose::model
