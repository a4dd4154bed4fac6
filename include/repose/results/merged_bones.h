#pragma once
#include <vector>

#include "repose/model/motion.h"

namespace repose::results {

/// All bone surfaces as one, for drawing: their points one after another.
struct MergedBones {
  std::vector<Vec3> points;         ///< [P] mm, initial
  std::vector<int32_t> point_bone;  ///< [P] row of Model::bones
  std::vector<Triangle> triangles;  ///< [T] rows of points
  std::vector<int32_t> bone;        ///< [T] row of Model::bones
};
MergedBones merge_bones(const std::vector<surface::Surface>& surfaces);

/// Where the points are at a load, mm; empty if no bone has moved.
std::vector<Vec3> moved_points(const MergedBones& bones, const model::PrescribedMotion& motion,
                               double load);

/// [P] How far the points have gone, mm, from where moved_points() says they are.
std::vector<Vec3> displacements(const MergedBones& bones, const std::vector<Vec3>& moved);

}  // namespace repose::results
