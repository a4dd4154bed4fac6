#pragma once
#include <optional>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// mm: bone that moves by less counts as bone at rest where the border of the skin and the region
/// that is solved are chosen.
constexpr double negligible_travel = 0.1;

/// Bounds of how far bones displace points: by their moves or, of the pieces of a scene's plan, by
/// any motion in its box. What depends on these bounds alone stays the same over the whole box.
class MotionRange {
 public:
  /// `bones` [scene.bones] at their initial place. Throws InputError where a move lies outside the
  /// plan's box.
  MotionRange(const scene::Scene& scene, const std::vector<surface::Surface>& bones);

  /// Largest distance, mm, by which a bone displaces a point.
  double travel(const Vec3& point, int32_t bone) const;
  /// Largest distance, mm, by which a bone displaces a point of a surface.
  double travel(const surface::Surface& body, int32_t bone) const;
  /// Largest difference, mm, between the displacements of a point by two different bones.
  double difference(const Vec3& point, int32_t bone, int32_t other) const;
  /// The move of a bone, or nothing for a piece of the plan, which may make many.
  std::optional<scene::RigidMotion> only_move(int32_t bone) const;

 private:
  struct Bone {
    scene::RigidMotion move;
    bool planned = false;
    Vec3 centroid = Vec3::Zero();
    double shift = 0;  // mm, the largest translation of the box
    double turn = 0;   // mm of displacement per mm from the centroid, by its largest rotation
  };
  std::vector<Bone> bones_;
};

}  // namespace repose::model
