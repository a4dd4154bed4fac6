#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// The side of the mouth that a bone belongs to.
enum class BoneRole { unknown, upper, lower };

/// Roles by name: a mandible, jaw or chin is lower; a skull, cranium or maxilla upper; a piece has
/// the role of the bone that it is cut off.
std::vector<BoneRole> roles_of(const scene::Scene& scene);

/// The bones of one role, taken together.
struct BoneGroup {
  Eigen::AlignedBox3d box;
  std::vector<Vec3> points;
  bool empty() const { return points.empty(); }
};
BoneGroup bones_of(BoneRole role, const std::vector<BoneRole>& roles,
                   const std::vector<surface::Surface>& bones);

/// Returns Σ (x − m)(x − m)ᵀ of points x, mm², about their mean m.
Mat3 scatter_of(const std::vector<Vec3>& points);

/// Directions of a head, unit vectors.
struct HeadDirections {
  Vec3 up, forward, left;  ///< along axes of the coordinates
  Vec3 facing, upward;     ///< as they are found: where the skin faces, and upward across that
};

/// Returns the directions of a head: up from the lower to the upper bones, forward where the skin
/// faces or, if it is closed, the jaw. Empty where the skin is of one side of the face, where jaw
/// and skull do not say which side is the front, and where one of the groups is missing.
std::optional<HeadDirections> head_directions(const SkinMesh& mesh, const BoneGroup& upper,
                                              const BoneGroup& lower);

/// Points of the jaw that a plan is judged by, on its surface.
struct JawPoints {
  Vec3 left_joint, right_joint;  ///< the highest point at the back on either side
  Vec3 chin, incisor;            ///< foremost and low, foremost and high, near the middle
};
JawPoints jaw_points(const BoneGroup& lower, const HeadDirections& frame);

}  // namespace repose::model
