#include "motion_range.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "repose/base/error.h"
#include "repose/scene/placement.h"

namespace repose::model {

MotionRange::MotionRange(const scene::Scene& scene, const std::vector<surface::Surface>& bones)
    : bones_(scene.bones.size()) {
  constexpr double half_degree = std::numbers::pi / 360;
  for (size_t b = 0; b < bones_.size(); ++b) bones_[b].move = scene.moves[b];
  if (!scene.plan) return;
  for (const size_t b : scene.plan->pieces) {
    const Vec3 centroid = scene::centroid(bones[b].points, bones[b].triangles);
    const std::string outside =
        scene::outside_box(scene::placement_of(scene.moves[b], centroid), *scene.plan);
    if (!outside.empty())
      base::refuse(
          "{}: plan.box: '{}' moves out of it: {}; make the box larger or the move smaller",
          scene.file.string(), scene.bones[b].name, outside);
    const double half_turn = half_degree * std::min(180.0, scene.plan->rotate.norm());
    bones_[b] = {scene.moves[b], true, centroid, scene.plan->translate.norm(),
                 2 * std::sin(half_turn)};
  }
}

double MotionRange::travel(const Vec3& point, int32_t bone) const {
  const Bone& by = bones_[bone];
  if (by.planned) return by.shift + by.turn * (point - by.centroid).norm();
  return (by.move.apply(point) - point).norm();
}

double MotionRange::travel(const surface::Surface& body, int32_t bone) const {
  double largest = 0;
  for (const Vec3& x : body.points) largest = std::max(largest, travel(x, bone));
  return largest;
}

double MotionRange::difference(const Vec3& point, int32_t bone, int32_t other) const {
  if (bone == other) return 0;
  if (bones_[bone].planned || bones_[other].planned)
    return travel(point, bone) + travel(point, other);
  return (bones_[bone].move.apply(point) - bones_[other].move.apply(point)).norm();
}

std::optional<scene::RigidMotion> MotionRange::only_move(int32_t bone) const {
  if (bones_[bone].planned) return {};
  return bones_[bone].move;
}

}  // namespace repose::model
