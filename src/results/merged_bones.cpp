#include "repose/results/merged_bones.h"

#include <algorithm>

namespace repose::results {

MergedBones merge_bones(const std::vector<surface::Surface>& surfaces) {
  MergedBones all;
  for (size_t b = 0; b < surfaces.size(); ++b) {
    const auto first = std::ssize(all.points);
    all.points.insert(all.points.end(), surfaces[b].points.begin(), surfaces[b].points.end());
    all.point_bone.resize(all.points.size(), static_cast<int32_t>(b));
    for (const Triangle& t : surfaces[b].triangles)
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    all.bone.resize(all.triangles.size(), static_cast<int32_t>(b));
  }
  return all;
}

std::vector<Vec3> moved_points(const MergedBones& bones, const model::PrescribedMotion& motion,
                               double load) {
  std::vector<Mat4> matrix;
  const int32_t count = bones.point_bone.empty() ? 0 : bones.point_bone.back() + 1;
  for (int32_t b = 0; b < count; ++b) matrix.push_back(motion.bone_matrix(b, load));
  const auto at_rest = [](const Mat4& m) { return m == Mat4::Identity(); };
  if (std::all_of(matrix.begin(), matrix.end(), at_rest)) return {};
  std::vector<Vec3> moved;
  for (size_t i = 0; i < bones.points.size(); ++i) {
    const Mat4& m = matrix[bones.point_bone[i]];
    moved.push_back(m.topLeftCorner<3, 3>() * bones.points[i] + m.topRightCorner<3, 1>());
  }
  return moved;
}

std::vector<Vec3> displacements(const MergedBones& bones, const std::vector<Vec3>& moved) {
  std::vector<Vec3> displacement(bones.points.size(), Vec3::Zero());
  for (size_t i = 0; i < moved.size(); ++i) displacement[i] = moved[i] - bones.points[i];
  return displacement;
}

}  // namespace repose::results
