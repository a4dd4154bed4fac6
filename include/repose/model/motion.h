#pragma once
#include <span>
#include <vector>

#include "repose/model/model.h"
#include "repose/scene/placement.h"

namespace repose::model {

/// Where the points that are not unknown are at a load: bone points follow the screw motion of
/// their bone, held points go straight to their target, boundary points stay. Load 1 is exactly
/// Points::target for held points and the bone's transform for bone points.
class PrescribedMotion {
 public:
  /// From bone_transform, or, where the model has none, recovered from position and target of each
  /// bone's points; where those are not rigid to 1e-9 of their extent, or fewer than three (or
  /// collinear), the bone's points move on straight lines. InputError for a bone_transform that is
  /// not rigid.
  explicit PrescribedMotion(const Model& model);

  /// Position (mm) of point `row` of the model it was made from, at `load` in [0, 1]; the initial
  /// position for a soft-tissue point.
  Vec3 at(const Model& model, int64_t row, double load) const;
  /// Gives a bone another whole motion.
  void set(int32_t bone, const scene::RigidMotion& motion);
  /// 4×4 matrix of a bone at a load, identity where it moves on straight lines.
  Mat4 bone_matrix(int32_t bone, double load) const;
  /// Returns whether the points of a bone move on straight lines because no rigid motion takes them
  /// to their targets.
  bool straight(int32_t bone) const { return straight_[bone]; }
  /// A bone and a row of a point.
  struct Beside {
    int32_t bone;
    int64_t point;
  };
  /// Largest path length between load 0 and 1, mm (chord of the screw over 16 parts), of any point
  /// that is not unknown and of any place of a bone where it has a point beside it.
  double largest_travel(const Model& model, std::span<const Beside> beside = {}) const;

 private:
  bool follows_screw(const Model& model, int64_t row) const;

  std::vector<scene::RigidMotion> motion_;  // [bones]
  std::vector<bool> straight_;              // [bones]
};

}  // namespace repose::model
