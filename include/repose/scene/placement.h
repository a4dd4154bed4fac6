#pragma once
#include "repose/scene/rigid_motion.h"
#include "repose/scene/scene.h"

namespace repose::scene {

/// Motion of a piece of bone as a plan states it: a rotation about its centroid, then a
/// translation. Both are zero for a piece that stays.
struct Placement {
  Vec3 translation = Vec3::Zero();  ///< mm, of the centroid
  Vec3 rotation = Vec3::Zero();     ///< degrees, the rotation vector: axis times angle
};

/// The rigid motion x ↦ R (x − c) + c + t of a placement, with c the piece's centroid, mm.
RigidMotion motion_of(const Placement& placement, const Vec3& centroid);

/// The placement of a rigid motion; its rotation is at most 180° long.
Placement placement_of(const RigidMotion& motion, const Vec3& centroid);

/// Centroid of a triangle surface, mm: the mean over its area.
Vec3 centroid(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles);

/// Describes the first component that is outside a plan's box, by more than rounding; empty if
/// there is none.
std::string outside_box(const Placement& placement, const Plan& plan);

}  // namespace repose::scene
