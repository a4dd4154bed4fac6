#pragma once
#include <memory>
#include <variant>
#include <vector>

#include "repose/model/model.h"
#include "repose/surface/distance_field.h"

namespace repose::mechanics {

/// Signed distance of `point` to a shape, negative inside, with its derivatives where it has any.
surface::Distance distance_to(const scene::Sphere& ball, const Vec3& point);
surface::Distance distance_to(const scene::Capsule& capsule, const Vec3& point);
surface::Distance distance_to(const scene::Box& box, const Vec3& point);
surface::Distance distance_to(const scene::HalfSpace& half, const Vec3& point);
inline surface::Distance distance_to(const surface::DistanceField& field, const Vec3& point) {
  return field.sample(point);
}

/// A body of a model, at the place that a load has given it.
class RigidBody {
 public:
  using Shape = std::variant<scene::Sphere, scene::Capsule, scene::Box, scene::HalfSpace,
                             surface::DistanceField>;
  RigidBody(Shape shape, int32_t bone, const Vec3& push)
      : shape_(std::make_shared<const Shape>(std::move(shape))), bone_(bone), push_(push) {}

  /// The body with rounded edges: a mesh's distances are read from a grid so many times coarser
  /// (surface::DistanceField::rounded); a closed form is itself.
  RigidBody rounded(double times) const;

  int32_t bone() const { return bone_; }  ///< −1 for one that is pushed
  const Vec3& push() const { return push_; }
  void place(const Mat3& rotation, const Vec3& shift) {
    rotation_ = rotation;
    shift_ = shift;
  }
  /// Where a point in space is beside the body as it was at load 0.
  Vec3 beside(const Vec3& point) const { return rotation_.transpose() * (point - shift_); }
  /// Inverse of beside().
  Vec3 in_space(const Vec3& beside) const { return rotation_ * beside + shift_; }
  /// Distance to a point given by beside(); the derivatives are those in space.
  surface::Distance distance(const Vec3& beside) const;
  /// Lower bound of the distance, which costs less than the distance to a mesh
  /// (surface::DistanceField::lower_bound).
  double lower_bound(const Vec3& beside, double enough) const;
  /// The exact distance of a point outside, without smoothing and without curvature.
  surface::Distance outside(const Vec3& beside) const;
  /// A direction in space in the body's own axes, and its inverse.
  Vec3 own_direction(const Vec3& direction) const { return rotation_.transpose() * direction; }
  Vec3 turned(const Vec3& own) const { return rotation_ * own; }
  /// Returns the depth of the deepest place inside, mm, at most `at_most`; that of a mesh to 2 %.
  double deepest(double at_most) const;

 private:
  std::shared_ptr<const Shape> shape_;
  int32_t bone_;
  Vec3 push_;
  Mat3 rotation_ = Mat3::Identity();
  Vec3 shift_ = Vec3::Zero();
};

/// Returns the mesh of a body of a model's contact, null for closed forms.
const surface::Surface* mesh_of(const model::Model& model, const model::Body& body);

/// Returns the bodies of a model's contact at load 0. The distances to meshes are known up to 6 mm,
/// and 4 spacings, outside them.
std::vector<RigidBody> make_bodies(const model::Model& model);

/// Takes bodies to where they are at a load: `bone_matrix` gives that of a bone.
template <class BoneMatrix>
void place_bodies(double load, BoneMatrix&& bone_matrix, std::vector<RigidBody>& bodies) {
  for (RigidBody& body : bodies) {
    Mat4 pose = Mat4::Identity();
    if (body.bone() >= 0)
      pose = bone_matrix(body.bone());
    else
      pose.topRightCorner<3, 1>() = load * body.push();
    body.place(pose.topLeftCorner<3, 3>(), pose.topRightCorner<3, 1>());
  }
}

/// Returns [C] mm, ContactPairs::offset of the contact of a model, whose bodies are at load 0.
std::vector<double> contact_offsets(const model::Model& model,
                                    const std::vector<RigidBody>& bodies);

}  // namespace repose::mechanics
