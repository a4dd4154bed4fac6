#include "repose/model/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "repose/base/error.h"
#include "repose/surface/edges.h"

namespace repose::model {

namespace {

/// Initial and final positions of the points that a bone carries.
struct Carried {
  std::vector<Vec3> from, to;
};

std::vector<Carried> carried_points(const Model& model) {
  std::vector<Carried> bones(model.bones.size());
  const Points& points = model.points;
  for (std::size_t i = 0; i < points.position.size(); ++i) {
    if (points.set[i] != PointSet::bone || points.bone[i] < 0) continue;
    bones[points.bone[i]].from.push_back(points.position[i]);
    bones[points.bone[i]].to.push_back(points.target[i]);
  }
  return bones;
}

scene::RigidMotion whole_motion(const Model& model, std::size_t bone) {
  try {
    return scene::RigidMotion::from_matrix(model.bone_transform[bone]);
  } catch (const base::InputError& error) {
    base::refuse("bone_transform of bone '{}': {}", model.bones[bone], error.what());
  }
}

bool is_fixed_in_space(PointSet set) {
  return set == PointSet::soft_tissue || set == PointSet::boundary;
}

constexpr int parts = 16;  // chords that stand for a screw's path

double path_length(const std::array<Mat4, parts + 1>& stations, const Vec3& point) {
  double length = 0;
  for (int part = 1; part <= parts; ++part) {
    const Mat4 step = stations[part] - stations[part - 1];
    length += (step.topLeftCorner<3, 3>() * point + step.topRightCorner<3, 1>()).norm();
  }
  return length;
}

}  // namespace

PrescribedMotion::PrescribedMotion(const Model& model)
    : motion_(model.bones.size()), straight_(model.bones.size(), false) {
  constexpr double rigid_tolerance = 1e-9;  // of the extent
  if (!model.bone_transform.empty()) {
    for (std::size_t b = 0; b < motion_.size(); ++b) motion_[b] = whole_motion(model, b);
    return;
  }
  const std::vector<Carried> bones = carried_points(model);
  for (std::size_t b = 0; b < bones.size(); ++b) {
    straight_[b] = true;
    if (!scene::determines_rotation(bones[b].from)) continue;
    const scene::RigidFit fit = scene::fit_rigid_motion(bones[b].from, bones[b].to);
    if (fit.residual > rigid_tolerance * surface::bounding_diagonal(bones[b].from)) continue;
    straight_[b] = false;
    motion_[b] = fit.motion;
  }
}

Vec3 PrescribedMotion::at(const Model& model, int64_t row, double load) const {
  const Vec3& from = model.points.position[row];
  if (is_fixed_in_space(model.points.set[row])) return from;
  if (follows_screw(model, row)) return motion_[model.points.bone[row]].apply(from, load);
  return (1 - load) * from + load * model.points.target[row];
}

void PrescribedMotion::set(int32_t bone, const scene::RigidMotion& motion) {
  motion_[bone] = motion;
  straight_[bone] = false;
}

bool PrescribedMotion::follows_screw(const Model& model, int64_t row) const {
  const int32_t bone = model.points.bone[row];
  return model.points.set[row] == PointSet::bone && bone >= 0 && !straight_[bone];
}

Mat4 PrescribedMotion::bone_matrix(int32_t bone, double load) const {
  return motion_[bone].matrix(load);
}

double PrescribedMotion::largest_travel(const Model& model, std::span<const Beside> beside) const {
  std::vector<std::array<Mat4, parts + 1>> stations(motion_.size());
  for (std::size_t b = 0; b < motion_.size(); ++b)
    for (int part = 0; part <= parts; ++part)
      stations[b][part] = motion_[b].matrix(static_cast<double>(part) / parts);
  double largest = 0;
  const Points& points = model.points;
  for (std::size_t i = 0; i < points.position.size(); ++i) {
    if (is_fixed_in_space(points.set[i])) continue;
    const double path = follows_screw(model, i)
                            ? path_length(stations[points.bone[i]], points.position[i])
                            : (points.target[i] - points.position[i]).norm();
    largest = std::max(largest, path);
  }
  for (const auto& [bone, point] : beside)
    largest = std::max(largest, path_length(stations[bone], points.position[point]));
  return largest;
}

}  // namespace repose::model
